#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/ply_mask.hpp"

namespace debulk {

struct SmoothOptions {
  double window_mm = 0;      // side of the square window; with fewer than three points, heights stay as they are
  double blur_mm2 = 0;       // variance, along x and along y, by which the heights are blurred: undone
  double least_known = 0.5;  // share of a window that must be known to give a height where there is none
  void check() const;
};

// Local quadratic least squares in a square window (Savitzky-Golay in the plane). White noise falls to about
// 0.9 / half-width in points, and cubics are preserved. A blur of variance v has added v / 2 times the Laplacian of the
// heights, which the fit subtracts. If some points of the window are unknown (drop-outs, the ply's edge), the fit uses
// those that are known. Where `where`, if given, is 0, a height is left as it is. Throws InputError and Stopped.
Grid<float> smooth_heights(const Grid<float>& heights, const PlyMask& ply, const SmoothOptions& options,
                           const Grid<std::uint8_t>* where = nullptr, int threads = 0, const Stop& stop = Stop());
// The same; `out` is overwritten, and its memory reused.
void smooth_heights(const Grid<float>& heights, const PlyMask& ply, const SmoothOptions& options, const Grid<std::uint8_t>* where,
                    Grid<float>& out, int threads, const Stop& stop);

}  // namespace debulk
