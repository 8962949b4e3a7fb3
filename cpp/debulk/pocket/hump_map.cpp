#include "debulk/pocket/hump_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace debulk {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Grid<double> means(const Grid<double>& seen, int step) {
  const double half = 0.5 * (step - 1);
  Grid<double> out(seen.nx / step, seen.ny / step, seen.position(half, half), step * seen.spacing, kNan);
  for (int j = 0; j < out.ny; ++j)
    for (int i = 0; i < out.nx; ++i) {
      double sum = 0;
      int count = 0;
      for (int b = 0; b < step; ++b) {
        const double* row = &seen.at(i * step, j * step + b);
        for (int a = 0; a < step; ++a)
          if (std::isfinite(row[a])) sum += row[a], ++count;
      }
      if (count > 0 && 2 * count >= step * step) out.at(i, j) = sum / count;
    }
  return out;
}

}  // namespace

Grid<double> hump_map(const Grid<double>& seen, double cell) {
  const Grid<double> mean = means(seen, std::max(1, static_cast<int>(std::lround(cell / seen.spacing))));
  Grid<double> out = mean;
  for (int j = 0; j < mean.ny; ++j)
    for (int i = 0; i < mean.nx; ++i) {
      std::array<double, 9> near;
      std::size_t k = 0;
      for (int b = -1; b <= 1; ++b)  // the border's cells stand for those beyond it
        for (int a = -1; a <= 1; ++a) near[k++] = mean.at(std::clamp(i + a, 0, mean.nx - 1), std::clamp(j + b, 0, mean.ny - 1));
      if (!std::all_of(near.begin(), near.end(), [](double z) { return std::isfinite(z); })) continue;
      std::nth_element(near.begin(), near.begin() + 4, near.end());
      out.at(i, j) = near[4];
    }
  return out;
}

double between(const Grid<double>& map, double column, double row) {
  const int i = static_cast<int>(std::floor(column)), j = static_cast<int>(std::floor(row));
  const double x = column - i, y = row - j;
  double sum = 0, share = 0;
  for (int b = 0; b <= 1; ++b)
    for (int a = 0; a <= 1; ++a) {
      if (!map.contains(i + a, j + b) || !std::isfinite(map.at(i + a, j + b))) continue;
      const double weight = (a == 0 ? 1 - x : x) * (b == 0 ? 1 - y : y);
      sum += weight * map.at(i + a, j + b), share += weight;
    }
  return share >= 0.5 ? sum / share : kNan;
}

}  // namespace debulk
