#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {

// How far measured heights lie above a surface, mm; NaN where nothing was measured.
Grid<float> residuals(const Grid<float>& heights, const Reference& fit, int threads = 0, const Stop& stop = Stop());

// Marks with 1 the squares of about 2 mm where a surface does not follow the heights to which it was fitted, and the
// squares beside them. The residual of a square is a trimmed mean over 3 by 3 squares of the medians in them, but at
// most the share `most` of the largest of these. A misfit is where it exceeds both `tolerance_mm` and eight times what
// noise makes of it (its robust deviation over the whole), over the area of at least four nodes. On a grid coarser
// than 1.3 mm nothing is marked.
Grid<std::uint8_t> misfit_squares(const Grid<float>& residual, double tolerance_mm, double most = 1.0, int threads = 0,
                                  const Stop& stop = Stop());

// The same for a fitted reference, with a tolerance of 0.2 mm. On the heights' grid; 1 only where there is a height.
Grid<std::uint8_t> misfits(const Grid<float>& heights, const Reference& fit, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
