#include "debulk/cloud/pinhole_outliers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr double band = 0.05;                    // points so near to the guessed threshold (relative to it) wait for the final one
constexpr double wide_low = 0.9, wide_high = 4;  // the same without a guess, relative to the least threshold
constexpr long sampled = 16;                     // of so many bands one is sampled for that
constexpr double rounding_px = 1e-3;             // float coordinates against exact rays
constexpr double most_open = 0.10;               // share of open points; a cloud with more is no sheet
constexpr long fewest = 1000;                    // points that a cloud must have

}  // namespace

// Returns false if the cloud is not a pinhole camera's, has too few points or is no sheet.
bool PinholeOutliers::pass(WindowPass& window, double& tolerance_px, int threads, const Stop& stop) {
  for (;;) {
    window.tolerance = tolerance_px + rounding_px;
    parallel_for(static_cast<long>(bands_.size()), 1, threads, stop,
                 [&](long begin, long) { window_pass(window, static_cast<int>(begin), bands_[static_cast<std::size_t>(begin)]); });
    long strays = 0, open = 0;
    summary_ = Outliers();
    for (const WindowBand& b : bands_) {
      strays += b.strays;
      open += static_cast<long>(b.open.size());
      summary_.seen += b.seen;
    }
    if (strays == 0) return summary_.seen >= fewest && static_cast<double>(open) <= most_open * static_cast<double>(summary_.seen);
    if (tolerance_px >= pinhole_tolerance) return false;
    tolerance_px = pinhole_tolerance;
  }
}

// The threshold if all distances were equal, from some of the bands.
double PinholeOutliers::least_threshold(WindowPass& window, const OutlierOptions& options, int threads, const Stop& stop) {
  window.tolerance = tolerance + rounding_px;
  parallel_for(static_cast<long>(bands_.size()), sampled, threads, stop,
               [&](long begin, long) { window_pass(window, static_cast<int>(begin), bands_[static_cast<std::size_t>(begin)]); });
  double sum = 0;
  long certain = 0;
  for (std::size_t at = 0; at < bands_.size(); at += static_cast<std::size_t>(sampled))
    sum += bands_[at].sum, certain += bands_[at].certain;
  return certain > 0 ? std::max(1.0, options.least_ratio) * sum / static_cast<double>(certain) : 0;
}

bool PinholeOutliers::run(const CloudView& cloud, const Pinhole& camera, const OutlierOptions& options, const RayBase* base, int threads,
                          const Stop& stop) {
  options.check();
  camera.check();
  if (!cloud.organised() || options.neighbours != 4 || cloud.size() >= (std::size_t{1} << 31)) return false;
  const std::size_t size = cloud.size();
  states_.resize(size);
  if (base && heights_.size() < heights_for(cloud.width, cloud.height)) heights_.resize(heights_for(cloud.width, cloud.height));
  tiles_.resize(cloud.width, cloud.height);
  bands_.resize(static_cast<std::size_t>((cloud.height + band_rows - 1) / band_rows));

  WindowPass window{cloud, camera, 0, 0, 0, certified, base, states_.data(), heights_.data(), &tiles_, isa};
  double tolerance_px = tolerance;
  std::size_t every = 1;
  for (int round = 0;; ++round) {
    window.low = guess * (1 - band), window.high = guess * (1 + band);
    if (guess == 0 && !base) {  // the tiles' mean heights take a narrow band
      const double least = least_threshold(window, options, threads, stop);
      window.low = wide_low * least, window.high = wide_high * least;
    }
    if (!pass(window, tolerance_px, threads, stop)) return false;
    double sum = 0, squares = 0;
    long certain = 0;
    for (const WindowBand& b : bands_) sum += b.sum, squares += b.squares, certain += b.certain;
    if (round == 0) {
      search_.prepare(window, bands_, threads);
      every = 1 + search_.count() / most_measured;
      search_.measure(distances_, every, sum / static_cast<double>(certain), threads, stop);
    }
    double open = 0, open_squares = 0, measured = 0;
    for (std::size_t k = 0; k < distances_.size(); k += every) {
      const double d = distances_[k];
      if (!std::isfinite(d)) return false;
      open += d, open_squares += d * d, ++measured;
    }
    const auto all_open = static_cast<double>(search_.count());
    const double n = static_cast<double>(certain) + all_open, weight = measured > 0 ? all_open / measured : 0;
    sum += weight * open, squares += weight * open_squares;
    summary_.mean = sum / n;
    summary_.deviation = std::sqrt(std::max(0.0, (squares - sum * summary_.mean) / (n - 1)));
    summary_.threshold = std::max(summary_.mean + options.std_ratio * summary_.deviation, options.least_ratio * summary_.mean);
    guess = summary_.threshold;
    if (round > 0 || (guess > window.low && guess <= window.high)) break;
  }

  search_.decide(distances_, every, summary_.threshold, threads, stop);
  const auto settle = [&](std::uint32_t pixel, float distance) {
    const bool keep = !(static_cast<double>(distance) > summary_.threshold);
    states_[pixel] = keep;
    if (!keep && base) heights_[pixel] = std::numeric_limits<float>::quiet_NaN();
  };
  parallel_for(static_cast<long>(bands_.size()), 1, threads, stop, [&](long begin, long) {
    for (const ClosePixel& c : bands_[static_cast<std::size_t>(begin)].close) settle(c.index, c.distance);
  });
  parallel_for(static_cast<long>(distances_.size()), 1 << 15, threads, stop, [&](long begin, long end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) settle(search_.pixel(k), distances_[k]);
  });
  return true;
}

}  // namespace debulk
