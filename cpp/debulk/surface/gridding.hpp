#pragma once

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

struct GriddingOptions {
  double jump_ratio = 6.0;  // a triangle with an edge longer than this many pitches spans a depth jump and is left out
  double pitch = 0.0;       // mm, the cloud's median pitch where it is known; 0: it is measured

  void check() const;
};

// The grid, with lines at multiples of its spacing, that covers as much of a box [low, high] of the XY plane as lies
// within the box. Throws InputError if it would have more than 2e8 points (a wrong spacing, a wrong unit or a stray
// point), or none.
Grid<float> covering_grid(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double spacing);

// Heights (z) of a cloud at the points of a grid, NaN where nothing was seen. The values of `grid` are overwritten.
//
// Organised clouds: every square of four neighbouring pixels gives two triangles (one if a corner is missing), and z
// is interpolated on them. A missing pixel between two that were seen, in its row or column, is bridged. Where
// surfaces lie above each other, the highest counts. If the grid is coarser than 1.5 pitches, z is taken on a grid an
// odd number of times finer, no coarser than the pitch, and averaged over the square round each grid point, in pairs
// of opposite points. This averages the noise, and a slope leaves no bias, even if half of a square is missing.
//
// Unorganised clouds: a plane is fitted to the points within max(spacing, 2 pitches) with weights (1 - d²/r²)², and
// its height is taken. The height is missing where it would be noisier than a single measured point.
//
// Returns how much this blurs the heights, as a variance along x and along y, mm2. Throws InputError and Stopped.
double grid_heights(const CloudView& cloud, Grid<float>& grid, const GriddingOptions& options = {}, int threads = 0,
                    const Stop& stop = Stop());

}  // namespace debulk
