#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/ply_mask.hpp"

namespace debulk {

struct SmoothOptions {
  double window_mm = 0;      // side of the square window; one below three points leaves the heights alone
  double blur_mm2 = 0;       // what the heights were blurred with before, as a variance along x and along y: undone
  double least_known = 0.5;  // share of a window that must be known to give a height where there is none
  void check() const;
};

// Local quadratic least squares in a square window (Savitzky-Golay in the plane): white noise falls to about
// 0.9 / half-width in points, cubics stay. A blur of variance v has added v / 2 times the Laplacian of the heights; the fit
// takes off so much. Fewer known points in the window (drop-outs, the ply's edge): the same fit over those that are there.
// 0 in `where`, if that is given, leaves a height alone.
Grid<float> smooth_heights(const Grid<float>& heights, const PlyMask& ply, const SmoothOptions& options,
                           const Grid<std::uint8_t>* where = nullptr, int threads = 0, const Stop& stop = Stop());

// Standard deviation of white noise of 1 at a height that smooth_heights() has smoothed, its whole window known; correlated
// noise keeps more.
double smoothing_gain(double window_mm, double spacing_mm);

}  // namespace debulk
