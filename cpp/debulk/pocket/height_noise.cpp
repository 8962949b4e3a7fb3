#include "debulk/pocket/height_noise.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "debulk/core/median.hpp"

namespace debulk {
namespace {

constexpr std::size_t kSamples = 100000;  // more hardly improve the estimate

}  // namespace

double height_noise(const Grid<float>& heights) {
  const int stride = 1 + static_cast<int>(heights.size() / kSamples);
  std::vector<float> sizes;
  for (int j = 1; j + 1 < heights.ny; j += stride)
    for (int i = 1; i + 1 < heights.nx; ++i) {
      const auto h = [&](int di, int dj) { return static_cast<double>(heights.at(i + di, j + dj)); };
      const double d = h(-1, -1) + h(1, -1) + h(-1, 1) + h(1, 1) - 2 * (h(0, -1) + h(0, 1) + h(-1, 0) + h(1, 0)) + 4 * h(0, 0);
      if (std::isfinite(d)) sizes.push_back(static_cast<float>(std::abs(d)));
    }
  if (sizes.empty()) return std::numeric_limits<double>::quiet_NaN();
  return upper_median(sizes) / 0.674490 / 6;  // median of |normal|; root of the sum of squared weights
}

}  // namespace debulk
