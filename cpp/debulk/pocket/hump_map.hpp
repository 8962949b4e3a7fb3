#pragma once

#include "debulk/core/grid.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// Medians over three by three means of squares of points, about `cell` mm wide; NaN where less than half of a square was
// seen. The median takes away what an outlier filter left, which is no wider than one square.
Grid<float> hump_map(const Grid<float>& seen, double cell);

// The part of a map that holds a box in its frame, and so many cells around.
Grid<float> part_of(const Grid<float>& map, const Box& box, int margin);

// The value between those of a map, at a column and a row; NaN where less than half of what it is made of is known.
double between(const Grid<float>& map, double column, double row);

}  // namespace debulk
