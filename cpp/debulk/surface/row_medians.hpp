#pragma once

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// The highest median of the rows of 5 or 13 cells about each value, in twelve directions; NaN where most of each row is missing.
// Of an even number of known values the median is the higher middle one. Of a straight ridge some row has its median within half
// a cell of the crest, where that of a window of 5 by 5 lies up to 1.5 cells away.
Grid<float> row_medians(const Grid<float>& grid, int cells, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
