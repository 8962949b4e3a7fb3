#include "debulk/pocket/smooth.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr long kRowsPerChunk = 16;

// The fit at (i, j) over whatever is known in its window; NaN when that does not hold a quadratic.
double fit(const Grid<float>& heights, int i, int j, int half, double least_share) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 right = Vector6::Zero();
  int known = 0;
  for (int dj = -half; dj <= half; ++dj)
    for (int di = -half; di <= half; ++di) {
      if (!heights.contains(i + di, j + dj)) continue;
      const double h = heights.at(i + di, j + dj), x = static_cast<double>(di) / half, y = static_cast<double>(dj) / half;
      if (std::isnan(h)) continue;
      Vector6 terms;
      terms << 1, x, y, x * x, x * y, y * y;
      matrix.selfadjointView<Eigen::Lower>().rankUpdate(terms);
      right += h * terms;
      ++known;
    }
  const double whole = (2.0 * half + 1) * (2.0 * half + 1);
  if (known < std::max(9.0, least_share * whole)) return std::numeric_limits<double>::quiet_NaN();
  matrix.diagonal().array() += 1e-9 * known;
  return matrix.ldlt().solve(right)[0];
}

}  // namespace

double height_noise(const Grid<float>& heights) {
  std::vector<float> sizes;
  for (int j = 1; j + 1 < heights.ny; ++j)
    for (int i = 1; i + 1 < heights.nx; ++i) {
      const auto h = [&](int di, int dj) { return static_cast<double>(heights.at(i + di, j + dj)); };
      const double d = h(-1, -1) + h(1, -1) + h(-1, 1) + h(1, 1) - 2 * (h(0, -1) + h(0, 1) + h(-1, 0) + h(1, 0)) + 4 * h(0, 0);
      if (std::isfinite(d)) sizes.push_back(static_cast<float>(std::abs(d)));
    }
  if (sizes.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = sizes.begin() + static_cast<long>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle / 0.674490 / 6;  // median of |normal|; the root of the sum of squared weights
}

Grid<float> smooth_heights(const Grid<float>& heights, const PlyMask& ply, double window_mm) {
  require(std::isfinite(window_mm) && window_mm >= 0, "smooth_mm", "a length in mm, not negative", window_mm);
  const int half = static_cast<int>(std::lround(window_mm / (2 * heights.spacing)));
  if (half < 1) return heights;

  // With the whole window known, odd terms drop out, and the fit's value at the centre is sum (a + b (x^2 + y^2)) h.
  double n = 2.0 * half + 1, x2 = 0, x4 = 0;
  for (int k = 1; k <= half; ++k) x2 += 2.0 * k * k, x4 += 2.0 * k * k * k * k;
  const double s0 = n * n, s2 = n * x2, s4 = n * x4, s22 = x2 * x2;
  const double a = 1 / (s0 - 2 * s2 * s2 / (s4 + s22)), b = -a * s2 / (s4 + s22);

  // Sums along rows; NaN marks a window that is not whole.
  const double missing = std::numeric_limits<double>::quiet_NaN();
  auto sums = heights.like<double>(missing), squares = heights.like<double>(missing);
  parallel_for(heights.ny, kRowsPerChunk, 0, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = half; i < heights.nx - half; ++i) {
        double sum = 0, square = 0;
        for (int k = -half; k <= half; ++k) {
          const double h = heights.at(i + k, j);
          sum += h;
          square += static_cast<double>(k * k) * h;
        }
        sums.at(i, j) = sum;
        squares.at(i, j) = square;
      }
  });
  auto out = heights;
  parallel_for(heights.ny, kRowsPerChunk, 0, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < heights.nx; ++i) {
        const bool known = !std::isnan(heights.at(i, j));
        if (!known && !ply.on_ply(i, j)) continue;
        double value = missing;
        if (known && j >= half && j < heights.ny - half && i >= half && i < heights.nx - half) {
          value = 0;
          for (int k = -half; k <= half; ++k) value += (a + b * k * k) * sums.at(i, j + k) + b * squares.at(i, j + k);
        }
        if (std::isnan(value)) value = fit(heights, i, j, half, known ? 0 : 0.5);
        if (!std::isnan(value)) out.at(i, j) = static_cast<float>(value);
      }
  });
  return out;
}

}  // namespace debulk
