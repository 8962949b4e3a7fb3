#pragma once

#include <algorithm>
#include <array>

#include <Eigen/Core>

#include "debulk/cloud/cloud_view.hpp"

namespace debulk {

// Squares of pixels of an organised cloud, which may overlap, counted row by row.
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

// Differences of neighbours along a row of a square. They are taken of the points, and then along an axis: those of
// single-precision neighbours are exact.
template <int order>
class RowDifferences {
 public:
  static constexpr int count = SquareLattice::side - order;

  explicit RowDifferences(const float* row) {
    std::copy(row, row + 3 * SquareLattice::side, values_.begin());
    for (int n = 1; n <= order; ++n)
      for (int k = 0; k < 3 * (SquareLattice::side - n); ++k) values_[k] = values_[k + 3] - values_[k];
  }
  // Missing x and y make none along the scanner's own z missing.
  float along(const Eigen::Vector3f& axis, int k) const {
    const float* d = &values_[3 * k];
    return axis[0] == 0 && axis[1] == 0 ? axis[2] * d[2] : axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2];
  }

 private:
  std::array<float, 3 * SquareLattice::side> values_;
};

// Share of the fourth differences along every third row of a square that are at most a limit; 0 where less than half were seen.
float share_of_low(const SquareLattice& lattice, int square, const Eigen::Vector3f& axis, float limit);

// What lies along an axis in one row of a square less its cubic, mm, NaN where not all of the row was seen. A row that carries no
// noise, but was rounded, has residuals up to about half a step.
using RowResiduals = std::array<float, SquareLattice::side>;
RowResiduals row_residuals(const float* row, const Eigen::Vector3f& axis);

// What lies along an axis in a square. One in which more than a tenth of the pixels are missing is not `whole`, and has no figures.
class SquareHeights {
 public:
  static constexpr int pixels = SquareLattice::side * SquareLattice::side;

  SquareHeights(const SquareLattice& lattice, int square, const Eigen::Vector3f& axis);

  bool whole() const { return whole_; }
  // Root mean square of what is left of the heights without the cubic in row and column that fits them best, mm.
  float scatter() const { return scatter_; }
  // Share of the pixels that the cubic misses by more than a bound.
  float share_beyond(float bound) const;
  // Heights that differ by at most `alike` are one level. How many levels there are, the least difference of two (0: there is
  // but one), and the difference of the highest and the lowest.
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
