#include "debulk/pocket/smooth.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr long kRowsPerChunk = 32;
constexpr std::size_t kSamples = 500000;  // of the noise: more do not tell more

// Sums over the known points of one row's window: of x^a, and of x^a times the height.
struct RowMoments {
  std::array<double, 5> x{};
  std::array<double, 3> xh{};
};

// The least-squares quadratic through the known points of a (2 half + 1)^2 window, from its rows' sums; distances in
// half-widths.
class WindowFit {
 public:
  explicit WindowFit(int half) : half_(half) {
    // With the whole window known, odd terms drop out, and the value at the centre is sum (a + b (x^2 + y^2)) h.
    const double n = 2.0 * half + 1;
    double x2 = 0, x4 = 0;
    for (int k = -half; k <= half; ++k) {
      const double x = static_cast<double>(k) / half;
      power_of_.push_back({1, x, x * x, x * x * x, x * x * x * x});
      x2 += x * x, x4 += x * x * x * x;
    }
    const double s0 = n * n, s2 = n * x2, s4 = n * x4 + x2 * x2;
    whole_ = s0;
    a_ = 1 / (s0 - 2 * s2 * s2 / s4);
    b_ = -a_ * s2 / s4;
  }

  double whole() const { return whole_; }

  // row(k): the moments k rows from the centre. NaN when fewer than `least` points are known.
  template <class Row>
  double at_centre(const Row& row, double least) const {
    double count = 0, value = 0;
    for (int k = -half_; k <= half_; ++k) {
      const RowMoments& m = row(k);
      count += m.x[0];
      value += (a_ + b_ * power_of_[static_cast<std::size_t>(k + half_)][2]) * m.xh[0] + b_ * m.xh[2];
    }
    if (count == whole_) return value;
    if (count < std::max(9.0, least)) return std::numeric_limits<double>::quiet_NaN();

    double moment[5][5] = {};  // sum x^a y^b, a + b <= 4
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (int k = -half_; k <= half_; ++k) {
      const RowMoments& m = row(k);
      const auto& y = power_of_[static_cast<std::size_t>(k + half_)];
      for (std::size_t a = 0; a < 5; ++a)
        for (std::size_t b = 0; a + b < 5; ++b) moment[a][b] += m.x[a] * y[b];
      for (int t = 0; t < 6; ++t) right[t] += m.xh[kTerm[t][0]] * y[kTerm[t][1]];
    }
    Eigen::Matrix<double, 6, 6> matrix;
    for (int s = 0; s < 6; ++s)
      for (int t = 0; t < 6; ++t) matrix(s, t) = moment[kTerm[s][0] + kTerm[t][0]][kTerm[s][1] + kTerm[t][1]];
    matrix.diagonal().array() += 1e-9 * count;
    return matrix.ldlt().solve(right)[0];
  }

  const std::array<double, 5>& powers(int k) const { return power_of_[static_cast<std::size_t>(k + half_)]; }

 private:
  static constexpr std::size_t kTerm[6][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  int half_;
  double whole_, a_, b_;
  std::vector<std::array<double, 5>> power_of_;
};

RowMoments row_moments(const Grid<float>& heights, int i, int j, int half, const WindowFit& fit) {
  RowMoments m;
  if (j < 0 || j >= heights.ny) return m;
  for (int k = std::max(-half, -i); k <= half && i + k < heights.nx; ++k) {
    const double h = heights.at(i + k, j);
    if (std::isnan(h)) continue;
    const auto& x = fit.powers(k);
    for (std::size_t a = 0; a < 5; ++a) m.x[a] += x[a];
    for (std::size_t a = 0; a < 3; ++a) m.xh[a] += x[a] * h;
  }
  return m;
}

}  // namespace

double height_noise(const Grid<float>& heights) {
  std::vector<float> sizes;
  const int stride = 1 + static_cast<int>(heights.size() / kSamples);
  for (int j = 1; j + 1 < heights.ny; j += stride)
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

Grid<float> smooth_heights(const Grid<float>& heights, const PlyMask& ply, double window_mm, const Grid<std::uint8_t>* where) {
  require(std::isfinite(window_mm) && window_mm >= 0, "smooth_mm", "a length in mm, not negative", window_mm);
  const int half = static_cast<int>(std::lround(window_mm / (2 * heights.spacing)));
  auto out = heights;
  if (half < 1) return out;
  const WindowFit fit(half);
  const auto wanted = [&](int i, int j) { return !where || where->at(i, j) != 0; };
  parallel_for(heights.ny, kRowsPerChunk, 0, [&](long begin, long end) {
    const int first = static_cast<int>(begin), last = static_cast<int>(end) - 1;
    int left = heights.nx, right = -1;  // columns in which anything is wanted
    for (int j = first; j <= last; ++j)
      for (int i = 0; i < heights.nx; ++i)
        if (wanted(i, j)) left = std::min(left, i), right = std::max(right, i);
    if (right < 0) return;
    const auto width = static_cast<std::size_t>(right - left + 1);
    std::vector<RowMoments> moments(width * static_cast<std::size_t>(last - first + 1 + 2 * half));
    const auto moment = [&](int i, int j) -> RowMoments& {
      return moments[static_cast<std::size_t>(j - first + half) * width + static_cast<std::size_t>(i - left)];
    };
    const auto near_wanted = [&](int i, int j) {
      for (int k = std::max(first, j - half); k <= std::min(last, j + half); ++k)
        if (wanted(i, k)) return true;
      return false;
    };
    for (int j = first - half; j <= last + half; ++j)
      for (int i = left; i <= right; ++i)
        if (near_wanted(i, j)) moment(i, j) = row_moments(heights, i, j, half, fit);
    for (int j = first; j <= last; ++j)
      for (int i = left; i <= right; ++i) {
        if (!wanted(i, j) || !ply.on_ply(i, j)) continue;
        const double least = std::isnan(heights.at(i, j)) ? fit.whole() / 2 : 0;
        const double value = fit.at_centre([&](int k) -> const RowMoments& { return moment(i, j + k); }, least);
        if (!std::isnan(value)) out.at(i, j) = static_cast<float>(value);
      }
  });
  return out;
}

}  // namespace debulk
