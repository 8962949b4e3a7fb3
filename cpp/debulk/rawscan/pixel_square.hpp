#pragma once

#include <algorithm>
#include <array>

#include <Eigen/Core>

#include "debulk/cloud/cloud_view.hpp"

namespace debulk {

// Squares of pixels of an organised cloud. They may overlap and are numbered row by row.
struct SquareLattice {
  static constexpr int side = 12;  // pixels

  CloudView cloud;
  int step = side;  // pixels from one square to the next, along rows and columns

  int rows() const { return cloud.height < side ? 0 : (cloud.height - side) / step + 1; }
  int columns() const { return cloud.width < side ? 0 : (cloud.width - side) / step + 1; }
  int count() const { return rows() * columns(); }
  // A point of a square.
  const float* point(int square, int column, int row) const {
    return cloud.point(square % columns() * step + column, square / columns() * step + row);
  }
};

// Differences of order `order` between neighbours along a row of a square. Differences of the points are taken first,
// and then their components along an axis, because differences of single-precision neighbours are exact.
template <int order>
class RowDifferences {
 public:
  static constexpr int count = SquareLattice::side - order;

  explicit RowDifferences(const float* row) {
    std::copy(row, row + 3 * SquareLattice::side, values_.begin());
    for (int n = 1; n <= order; ++n)
      for (int k = 0; k < 3 * (SquareLattice::side - n); ++k) values_[k] = values_[k + 3] - values_[k];
  }
  // Along the scanner's own z, a missing x or y does not make the difference missing.
  float along(const Eigen::Vector3f& axis, int k) const {
    const float* d = &values_[3 * k];
    return axis[0] == 0 && axis[1] == 0 ? axis[2] * d[2] : axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2];
  }

 private:
  std::array<float, 3 * SquareLattice::side> values_;
};

// Share of the fourth differences along every third row of a square that are at most `limit`; 0 if fewer than half of
// them were seen.
float share_of_low(const SquareLattice& lattice, int square, const Eigen::Vector3f& axis, float limit);

// Residuals, in mm, of the heights along an axis in one row of a square about the cubic that fits them best; NaN where
// not all of the row was seen. A row without noise that was rounded has residuals of up to about half a step.
using RowResiduals = std::array<float, SquareLattice::side>;
RowResiduals row_residuals(const float* row, const Eigen::Vector3f& axis);

// The heights along an axis in a square. If more than a tenth of the pixels, or all pixels of a row, are missing, the
// square is not `whole` and the other figures are not computed.
class SquareHeights {
 public:
  static constexpr int pixels = SquareLattice::side * SquareLattice::side;

  SquareHeights(const SquareLattice& lattice, int square, const Eigen::Vector3f& axis);

  bool whole() const { return whole_; }
  // Root mean square of the residuals of the heights about the cubic in row and column that fits them best, mm.
  float scatter() const { return scatter_; }
  // Share of the pixels whose residual exceeds `bound` (mm).
  float share_beyond(float bound) const;
  // Heights that differ by at most `alike` (mm) are one level. `count` is the number of levels, `least_gap` the least
  // difference between two of them (0: there is only one), and `range` the difference between the highest and the
  // lowest height.
  struct Levels {
    int count = 0;
    float least_gap = 0, range = 0;
  };
  Levels levels(float alike) const;

 private:
  void fill_missing();
  void take_cubic();

  std::array<float, pixels> heights_{}, residuals_{};  // above the first point; residuals are NaN where nothing was seen
  std::array<bool, pixels> seen_{};
  bool whole_ = false;
  float scatter_ = 0;
};

}  // namespace debulk
