#pragma once

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// The median of the known values in a window of size by size (3 or 5) round each value. If their number is even, it is
// the mean of the middle two. A missing value stays missing.
Grid<float> median(const Grid<float>& grid, int size = 3, int threads = 0);
// The same, written into a grid that exists already and is not the input. Throws Stopped.
void median(const Grid<float>& grid, int size, Grid<float>& out, int threads, const Stop& stop = Stop());

// Removes spikes that are not ply: two flying pixels side by side pass both an outlier filter and a 3 by 3 median. A
// value that differs by more than the tolerance (mm) from the median of itself and the eight values two points away is
// replaced by that median. The top of a narrow bump may differ as much; but there the eight values differ, too, and the
// tolerance is wider by the second highest less the second lowest of them. It is not where no 3 by 3 values stand: pixels
// that fly side by side in one row make a row of two.
void without_spikes(const Grid<float>& grid, double tolerance, Grid<float>& out, int threads, const Stop& stop = Stop());

}  // namespace debulk
