#include "debulk/pocket/height_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace debulk {
namespace {

constexpr std::size_t kSamples = 100000;  // more hardly improve the estimate

}  // namespace

double height_noise(const Grid<float>& heights) {
  return height_noise(std::vector<GridPart>{{&heights, 0, 0, heights.nx, heights.ny}});
}

double height_noise(const std::vector<GridPart>& parts) {
  std::size_t points = 0;
  for (const GridPart& p : parts) points += static_cast<std::size_t>(p.i1 - p.i0) * static_cast<std::size_t>(p.j1 - p.j0);
  const int stride = 1 + static_cast<int>(points / kSamples);
  std::vector<float> sizes;
  for (const GridPart& p : parts)
    for (int j = p.j0 + 1; j + 1 < p.j1; j += stride)
      for (int i = p.i0 + 1; i + 1 < p.i1; ++i) {
        const auto h = [&](int di, int dj) { return static_cast<double>(p.grid->at(i + di, j + dj)); };
        const double d = h(-1, -1) + h(1, -1) + h(-1, 1) + h(1, 1) - 2 * (h(0, -1) + h(0, 1) + h(-1, 0) + h(1, 0)) + 4 * h(0, 0);
        if (std::isfinite(d)) sizes.push_back(static_cast<float>(std::abs(d)));
      }
  if (sizes.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = sizes.begin() + static_cast<long>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle / 0.674490 / 6;  // median of |normal|; root of the sum of squared weights
}

}  // namespace debulk
