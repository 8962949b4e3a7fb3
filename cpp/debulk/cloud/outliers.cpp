#include "debulk/cloud/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "debulk/cloud/neighbours.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

// The sum of term(value) over the finite values, in double and in a fixed order, and the number of these values.
template <class Term>
std::pair<double, long> ordered_sum(const std::vector<float>& values, int threads, const Stop& stop, const Term& term) {
  constexpr long chunk = 1 << 16;
  const long count = static_cast<long>(values.size());
  std::vector<std::pair<double, long>> parts(static_cast<std::size_t>((count + chunk - 1) / chunk));
  parallel_for(count, chunk, threads, stop, [&](long begin, long end) {
    auto& [sum, finite] = parts[static_cast<std::size_t>(begin / chunk)];
    for (long i = begin; i < end; ++i) {
      const float value = values[static_cast<std::size_t>(i)];
      if (!std::isfinite(value)) continue;
      sum += term(static_cast<double>(value));
      ++finite;
    }
  });
  std::pair<double, long> total{0.0, 0};
  for (const auto& [sum, finite] : parts) {
    total.first += sum;
    total.second += finite;
  }
  return total;
}

}  // namespace

void OutlierOptions::check() const {
  require(neighbours >= 1 && neighbours <= 1000, "neighbours", "1 to 1000", neighbours);
  require(std::isfinite(std_ratio) && std_ratio >= 0, "std_ratio", "0 or more standard deviations", std_ratio);
  require(std::isfinite(least_ratio) && least_ratio >= 0, "least_ratio", "0 or more times the mean", least_ratio);
}

Outliers remove_outliers(const CloudView& cloud, const OutlierOptions& options, int threads, const Stop& stop) {
  options.check();
  const std::vector<float> distances = mean_neighbour_distances(cloud, options.neighbours, threads, stop);

  Outliers out;
  const auto [sum, count] = ordered_sum(distances, threads, stop, [](double d) { return d; });
  if (count > 0) out.mean = sum / static_cast<double>(count);
  const double mean = out.mean;
  const auto [squares, same] = ordered_sum(distances, threads, stop, [mean](double d) { return (d - mean) * (d - mean); });
  if (same > 1) out.deviation = std::sqrt(squares / static_cast<double>(same - 1));
  out.threshold = std::max(out.mean + options.std_ratio * out.deviation, options.least_ratio * out.mean);

  out.keep.resize(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % (1 << 20) == 0 && stop.now()) throw Stopped("the search for outliers was stopped");
    const bool seen = cloud.seen(i);
    out.keep[i] = seen && !(static_cast<double>(distances[i]) > out.threshold);
    out.seen += seen;
    out.removed += seen && !out.keep[i];
  }
  return out;
}

}  // namespace debulk
