#pragma once

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {

struct FitOptions {
  double spacing = 4.0;  // mm between the fitted heights; rounded to a multiple of the grid's spacing
  double window = 12.0;  // mm, half width of the window of a local fit, before any doubling or halving
  double robust = 6.0;   // robust standard deviations off the first fit from which heights are left out of the second
  int doublings = 2;     // how often the window may be doubled where wider fits agree

  void check() const;
};

// Fits the smooth reference surface to measured heights with noise and gaps. A quadratic is fitted to the heights
// round each node, with weights (1 - u²)² along x and y, and gives the node's height. A surface that is quadratic is
// reproduced without bias, and noise sigma becomes about 1.7 sigma / (number of heights along the window) inside. If
// the fits in windows twice and four times as wide agree with the narrower ones within their noise, the widest that
// does is taken, because the reference's noise is the same in every cycle and would shift a pocket's outline in every
// cycle alike. Nodes with too little round them (gaps, the border of what was seen) are filled in so that the sum of
// squared second differences is least. The result covers the grid. Where the fits are off over several nodes (see
// misfit.hpp), the window is half as wide, and where they are still off, a quarter. Shape details narrower than that
// are smoothed: this is meant for a mold, not for a ply. Beside a cliff the surface is that of the side that the
// ply lies on (`under_ply`: 1 for heights inside its outline), else of the upper side, up to its last point, where a
// noise of 0.05 mm causes an error of 0.005 mm in the mean and 0.02 mm at most; see cliffs.hpp. Throws InputError and
// Stopped.
Reference fit_reference(const Grid<float>& heights, const FitOptions& options = {}, int threads = 0, const Stop& stop = Stop(),
                        const Grid<std::uint8_t>& under_ply = {});

}  // namespace debulk
