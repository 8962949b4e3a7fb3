#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Beside a cliff, sets the heights of its lower side to NaN, up to 40 mm away, so that a surface can be fitted to the
// upper side up to its last point. (No smooth surface leads from one side to the other.) A cliff separates two
// surfaces whose heights, taken as medians of squares of 2 mm, differ by more than any slope of 63 degrees explains,
// and by at least 4.7 mm; across a gap of some width, by more than a slope of 45 degrees explains, or by 12.7 mm. Of
// two surfaces the upper one stays, because a mold stands on its table, unless its area is less than an eighth of the
// largest one's, like that of a clamp. Returns the squares in which heights were removed; an empty grid if there is no
// cliff. Throws Stopped.
Grid<std::uint8_t> hide_below_cliffs(Grid<float>& heights, int threads = 0, const Stop& stop = Stop());

// 1 for heights on the surface that stays beside all others, and at its border; 0 for all others, however far from the
// cliff. An empty grid if there is no cliff. Throws Stopped.
Grid<std::uint8_t> above_cliffs(const Grid<float>& heights, int threads = 0, const Stop& stop = Stop());

// Continues the surface of the nodes (NaN: unknown) straight on to five rings of unknown nodes round it, where one of
// the squares is not farther away than 60 mm. A spline through nodes that leave the surface right after its last node
// would ring on the surface's side.
void go_on_over_cliffs(Grid<double>& nodes, const Grid<std::uint8_t>& squares);

}  // namespace debulk
