#pragma once

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Missing (NaN) heights such that the sum of squared second differences, z_xx² + 2 z_xy² + z_yy², is least: a thin plate
// over the nodes that are known, going on linearly beyond the last of them. Throws InputError where the known ones do
// not determine it (fewer than three, or all in a line).
Grid<double> fill_nodes(Grid<double> heights, const Stop& stop = Stop());

}  // namespace debulk
