#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace debulk {

// Finds the position of a grid point in an ascending list of point indices. The memory grows with the length of the
// list and the number of rows that it spans, not with its bounding box: the box of a thin ring would be as large as
// the map.
class PointIndex {
 public:
  // `points` is borrowed. nx: number of columns of the grid.
  PointIndex(const std::vector<std::size_t>& points, int nx) : points_(points), nx_(static_cast<std::size_t>(nx)) {
    if (points.empty()) return;
    first_row_ = static_cast<int>(points.front() / nx_), last_row_ = static_cast<int>(points.back() / nx_);
    starts_.assign(static_cast<std::size_t>(last_row_ - first_row_) + 2, points.size());
    std::size_t next = 0;
    for (std::size_t n = 0; n < points.size(); ++n)
      for (const std::size_t row = points[n] / nx_ - static_cast<std::size_t>(first_row_); next <= row; ++next) starts_[next] = n;
  }
  int first_row() const { return first_row_; }
  int last_row() const { return last_row_; }
  int column(std::size_t n) const { return static_cast<int>(points_[n] % nx_); }
  int row(std::size_t n) const { return static_cast<int>(points_[n] / nx_); }
  // The points of a row are [begin, end) of the list; begin and end are equal for a row without points.
  std::size_t begin(int row) const { return row < first_row_ || row > last_row_ ? 0 : starts_[static_cast<std::size_t>(row - first_row_)]; }
  std::size_t end(int row) const {
    return row < first_row_ || row > last_row_ ? 0 : starts_[static_cast<std::size_t>(row - first_row_) + 1];
  }
  // Position of the point (i, j) in the list; -1 if it is not in the list. i may lie outside the grid.
  long find(int i, int j) const {
    if (i < 0 || static_cast<std::size_t>(i) >= nx_ || j < 0) return -1;
    const std::size_t wanted = static_cast<std::size_t>(j) * nx_ + static_cast<std::size_t>(i);
    const auto last = points_.begin() + static_cast<long>(end(j));
    const auto at = std::lower_bound(points_.begin() + static_cast<long>(begin(j)), last, wanted);
    return at != last && *at == wanted ? at - points_.begin() : -1;
  }

 private:
  const std::vector<std::size_t>& points_;
  std::size_t nx_;
  int first_row_ = 0, last_row_ = -1;
  std::vector<std::size_t> starts_;  // position in the list at which each row starts
};

}  // namespace debulk
