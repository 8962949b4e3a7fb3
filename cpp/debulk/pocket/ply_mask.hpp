#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// Which points of a grid lie on the ply, and where the ply's outline crosses the lines between neighbouring points.
// The crossings keep an outline's area exact below the grid spacing at the ply's edge, where no height is known.
class PlyMask {
 public:
  PlyMask() = default;  // outline unknown: every point counts as on the ply
  // outline: a checked polygon, in the grid's frame. inner: points count that have none off the ply within so many cells
  // along x and along y; such a mask has no crossings.
  template <class T>
  PlyMask(const Polygon& outline, const Grid<T>& grid, int inner = 0)
      : PlyMask(outline, grid.nx, grid.ny, grid.origin, grid.spacing, inner) {}
  PlyMask(const Polygon& outline, int nx, int ny, const Eigen::Vector2d& origin, double spacing, int inner = 0);

  bool known() const { return !on_ply_.empty(); }
  bool on_ply(int i, int j) const { return on_ply_.empty() || on_ply_[static_cast<std::size_t>(j) * nx_ + i] != 0; }
  const std::uint8_t* row(int j) const { return on_ply_.empty() ? nullptr : &on_ply_[static_cast<std::size_t>(j) * nx_]; }
  // Whether the points [first, end) of a row all lie on the ply.
  bool covers(int j, int first, int end) const;
  // The fraction of the way from a point (i, j) on the ply to its 4-neighbour (i + di, j + dj) off it at which the
  // outline is crossed first.
  double crossing(int i, int j, int di, int dj) const;

 private:
  int nx_ = 0;
  std::vector<std::uint8_t> on_ply_;
  // The places, in grid units and sorted, where the outline crosses each row and each column.
  std::vector<std::vector<double>> rows_, columns_;
};

}  // namespace debulk
