#pragma once

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// The part of grid_heights (gridding.hpp) for a cloud whose points come in any order: it fits local planes.
double grid_unorganised(const CloudView& cloud, Grid<float>& grid, double pitch, int threads, const Stop& stop);

}  // namespace debulk
