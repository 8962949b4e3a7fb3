#pragma once

#include "debulk/core/grid.hpp"

namespace debulk {

// Takes out spikes that are no ply: two flying pixels side by side pass an outlier filter and a 3 by 3 median, but not the
// median of a value and the eight two cells away from it (of those that are there). A value farther than `tolerance` (mm)
// from that takes it. A missing value stays missing. `out` must be another grid.
void without_spikes(const Grid<float>& grid, double tolerance, Grid<float>& out, int threads = 0);

}  // namespace debulk
