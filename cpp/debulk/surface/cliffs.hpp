#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Beside a cliff, sets the heights of one side to NaN, up to 40 mm away, so that a surface can be fitted to the other
// side up to its last point. (No smooth surface leads from one side to the other.) A cliff separates two surfaces whose
// heights, taken as medians of squares of 2 mm, differ by more than any slope of 63 degrees explains, and by at least
// 4.7 mm; across a gap of some width, by more than a slope of 45 degrees explains, or by 12.7 mm. A surface that holds
// an eighth as many of the marks `under_ply` as any stays beside one that does not: a frame beside the ply may be higher
// than the mold. Of two such, or without marks, the upper one stays, because a mold stands on its table, unless its area
// is less than an eighth of the largest one's, like that of a clamp. `under_ply` is empty or marks cells of the heights'
// grid. Returns the squares in which heights were removed; an empty grid if there is no cliff. Throws Stopped.
Grid<std::uint8_t> hide_beside_cliffs(Grid<float>& heights, const Grid<std::uint8_t>& under_ply = {}, int threads = 0,
                                      const Stop& stop = Stop());

// 1 for heights on the surface that stays beside all others, and at its border; 0 for all others, however far from the
// cliff. An empty grid if there is no cliff. Throws Stopped.
Grid<std::uint8_t> above_cliffs(const Grid<float>& heights, int threads = 0, const Stop& stop = Stop());

// Continues the surface of the nodes (NaN: unknown) straight on to five rings of unknown nodes round it, where one of
// the squares is not farther away than 60 mm. A spline through nodes that leave the surface right after its last node
// would ring on the surface's side.
void go_on_over_cliffs(Grid<double>& nodes, const Grid<std::uint8_t>& squares);

}  // namespace debulk
