#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {

// How far measured heights lie above a surface; NaN where nothing was measured.
Grid<float> residuals(const Grid<float>& heights, const Reference& fit, int threads = 0, const Stop& stop = Stop());

// Where a surface is not that of the heights it was fitted to, in squares of about 2 mm: 1 where the residual, a trimmed mean over
// 3 by 3 squares of the medians in them, or the share `most` of the largest, exceeds `tolerance_mm` and eight times what noise makes of it
// (its robust deviation over the whole), over four nodes' area at least; and the squares beside those. None on a grid coarser than 1.3 mm.
Grid<std::uint8_t> misfit_squares(const Grid<float>& residual, double tolerance_mm, double most = 1.0, int threads = 0,
                                  const Stop& stop = Stop());

// The same of a fitted reference, on the heights' grid, 1 only where a height is; by more than 0.2 mm.
Grid<std::uint8_t> misfits(const Grid<float>& heights, const Reference& fit, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
