#pragma once

#include "debulk/core/grid.hpp"

namespace debulk {

// Means over squares of points, about `cell` mm wide; NaN where less than half was seen. Inside, a median over three by
// three of them takes away what an outlier filter left, which is no wider than one.
Grid<double> hump_map(const Grid<double>& seen, double cell);

// The value between those of a map, at a column and a row; NaN where less than half of what it is made of is known.
double between(const Grid<double>& map, double column, double row);

}  // namespace debulk
