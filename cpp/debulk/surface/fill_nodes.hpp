#pragma once

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Fills in missing (NaN) heights such that the sum of squared second differences, z_xx² + 2 z_xy² + z_yy², is least.
// The result is a thin plate over the known nodes that goes on linearly beyond the last of them. Throws InputError if
// the known nodes do not determine it (fewer than three, or all in a line), and Stopped.
Grid<double> fill_nodes(Grid<double> heights, const Stop& stop = Stop());

}  // namespace debulk
