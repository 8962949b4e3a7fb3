#include "debulk/rawscan/pixel_square.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace debulk {
namespace {

constexpr int side = SquareLattice::side;
constexpr int terms = 4;  // of a cubic
constexpr int between_rows = 3;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr int most_missing = SquareHeights::pixels / 10;

// Orthonormal polynomials of degree 0 to 3 on the pixels of a row (Gram's). Products of two of them are orthonormal on
// a square.
using Basis = std::array<std::array<float, side>, terms>;

Basis make_basis() {
  std::array<std::array<double, side>, terms> p{};
  for (int k = 0; k < terms; ++k) {
    for (int x = 0; x < side; ++x) p[k][x] = std::pow(x - 0.5 * (side - 1), k);
    for (int i = 0; i < k; ++i) {
      double along = 0;
      for (int x = 0; x < side; ++x) along += p[k][x] * p[i][x];
      for (int x = 0; x < side; ++x) p[k][x] -= along * p[i][x];
    }
    double square = 0;
    for (const double v : p[k]) square += v * v;
    for (double& v : p[k]) v /= std::sqrt(square);
  }
  Basis out{};
  for (int k = 0; k < terms; ++k)
    for (int x = 0; x < side; ++x) out[k][x] = static_cast<float>(p[k][x]);
  return out;
}

const Basis& basis() {
  static const Basis one = make_basis();
  return one;
}

// The distance of a point from another along an axis.
float along(const Eigen::Vector3f& axis, const float* from, const float* to) {
  if (axis[0] == 0 && axis[1] == 0) return axis[2] * (to[2] - from[2]);
  return axis[0] * (to[0] - from[0]) + axis[1] * (to[1] - from[1]) + axis[2] * (to[2] - from[2]);
}

}  // namespace

float share_of_low(const SquareLattice& lattice, int square, const Eigen::Vector3f& axis, float limit) {
  int low = 0, seen = 0, count = 0;
  for (int row = 0; row < side; row += between_rows) {
    const RowDifferences<4> differences(lattice.point(square, 0, row));
    for (int k = 0; k < differences.count; ++k, ++count) {
      const float size = std::abs(differences.along(axis, k));
      seen += std::isfinite(size), low += size <= limit;
    }
  }
  return 2 * seen >= count && seen > 0 ? static_cast<float>(low) / static_cast<float>(seen) : 0.0f;
}

RowResiduals row_residuals(const float* row, const Eigen::Vector3f& axis) {
  RowResiduals z;
  for (int k = 0; k < side; ++k) z[k] = along(axis, row, row + 3 * k);
  std::array<float, terms> moments{};
  for (int i = 0; i < terms; ++i)
    for (int k = 0; k < side; ++k) moments[i] += basis()[i][k] * z[k];
  for (int i = 0; i < terms; ++i)
    for (int k = 0; k < side; ++k) z[k] -= moments[i] * basis()[i][k];
  return z;
}

SquareHeights::SquareHeights(const SquareLattice& lattice, int square, const Eigen::Vector3f& axis) {
  const float* first = nullptr;
  int missing = 0;
  for (int row = 0; row < side; ++row) {
    const float* p = lattice.point(square, 0, row);
    for (int column = 0; column < side; ++column, p += 3) {
      const int k = row * side + column;
      seen_[k] = std::isfinite(p[0] + p[1] + p[2]);
      if (!seen_[k]) {
        if (++missing > most_missing) return;
        continue;
      }
      if (first == nullptr) first = p;
      heights_[k] = along(axis, first, p);
    }
  }
  whole_ = true;
  if (missing > 0) fill_missing();
  if (whole_) take_cubic();
}

// A missing pixel takes the mean of the nearest pixels on both sides that were seen in its row. If a tenth of the
// pixels are filled in so, the cubic is hardly bent.
void SquareHeights::fill_missing() {
  for (int row = 0; row < side && whole_; ++row) {
    const int begin = row * side, end = begin + side;
    for (int k = begin; k < end; ++k) {
      if (seen_[k]) continue;
      int left = k, right = k;
      while (left >= begin && !seen_[left]) --left;
      while (right < end && !seen_[right]) ++right;
      whole_ = left >= begin || right < end;
      if (!whole_) return;
      heights_[k] = 0.5f * (heights_[left >= begin ? left : right] + heights_[right < end ? right : left]);
    }
  }
}

void SquareHeights::take_cubic() {
  const Basis& p = basis();
  float rows[side][terms] = {}, cubic[terms][terms] = {};
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < terms; ++i)
      for (int x = 0; x < side; ++x) rows[j][i] += heights_[j * side + x] * p[i][x];
  for (int i = 0; i < terms; ++i)
    for (int n = 0; n + i < terms; ++n)
      for (int j = 0; j < side; ++j) cubic[n][i] += rows[j][i] * p[n][j];
  float sum = 0;
  int count = 0;
  for (int j = 0; j < side; ++j) {
    float factors[terms] = {};
    for (int n = 0; n < terms; ++n)
      for (int i = 0; i < terms; ++i) factors[i] += cubic[n][i] * p[n][j];
    for (int x = 0; x < side; ++x) {
      float fit = 0;
      for (int i = 0; i < terms; ++i) fit += factors[i] * p[i][x];
      const int k = j * side + x;
      residuals_[k] = seen_[k] ? heights_[k] - fit : nan;
      if (seen_[k]) sum += residuals_[k] * residuals_[k], ++count;
    }
  }
  scatter_ = std::sqrt(sum / static_cast<float>(count));
}

float SquareHeights::share_beyond(float bound) const {
  int beyond = 0, count = 0;
  for (int k = 0; k < pixels; ++k) beyond += std::abs(residuals_[k]) > bound, count += seen_[k];
  return static_cast<float>(beyond) / static_cast<float>(count);
}

SquareHeights::Levels SquareHeights::levels(float alike) const {
  std::array<float, pixels> sorted;
  int n = 0;
  for (int k = 0; k < pixels; ++k)
    if (seen_[k]) sorted[n++] = heights_[k];
  std::sort(sorted.begin(), sorted.begin() + n);
  Levels out{1, 0, sorted[n - 1] - sorted[0]};
  float level = sorted[0];
  for (int k = 1; k < n; ++k) {
    const float gap = sorted[k] - level;
    if (!(gap > alike)) continue;
    out.least_gap = out.count == 1 ? gap : std::min(out.least_gap, gap);
    level = sorted[k], ++out.count;
  }
  return out;
}

}  // namespace debulk
