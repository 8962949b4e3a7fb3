#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Takes out (NaN) the heights beside a cliff that are of its lower side, up to 40 mm away, so that a surface can be fitted
// to the upper side up to its last point: from one to the other no smooth surface leads. A cliff parts two surfaces whose
// heights, medians of squares of 2 mm, differ by more than any slope of 63 degrees explains, by 4.7 mm at least; across a
// gap of some width, by more than one of 45 degrees or by 12.7 mm. Of two surfaces the upper one stays, for a mold stands on its table,
// unless it has less than an eighth of the other's area, as a clamp. Returns the squares in which heights were taken out; empty: there is
// no cliff.
Grid<std::uint8_t> hide_below_cliffs(Grid<float>& heights, int threads = 0, const Stop& stop = Stop());

// 0 for heights on the lower side of a cliff, however far from it, 1 for all others. Empty: there is no cliff.
Grid<std::uint8_t> above_cliffs(const Grid<float>& heights, int threads = 0, const Stop& stop = Stop());

// Continues the nodes' surface (NaN: unknown) on to five rings of unknown nodes round it, straight, where one of the squares
// is not farther away than 60 mm. A spline through nodes that leave the surface at its last one would ring on this side of it.
void go_on_over_cliffs(Grid<double>& nodes, const Grid<std::uint8_t>& squares);

}  // namespace debulk
