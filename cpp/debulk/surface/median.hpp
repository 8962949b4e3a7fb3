#pragma once

#include "debulk/core/grid.hpp"

namespace debulk {

// The median of the values that are there in a window of size by size (3 or 5) round each value; the mean of the middle
// two where their number is even. A missing value stays missing.
Grid<float> median(const Grid<float>& grid, int size = 3, int threads = 0);
// The same into a grid that is there; it must be another.
void median(const Grid<float>& grid, int size, Grid<float>& out, int threads);

}  // namespace debulk
