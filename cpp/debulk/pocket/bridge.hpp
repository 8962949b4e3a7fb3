#pragma once

#include <cstddef>
#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// Heights for the unknown points `region` (ascending indices; NaN in the grid): the least-bent surface through the known
// heights around them (thin plate: least sum of squared second differences). It goes on with the slopes at the region's
// rim, so a crest stays a crest and two slopes that fall towards each other meet in a valley: across a drop-out, two
// pockets stay two and one stays one. Empty when no known point touches the region.
std::vector<float> bridge(const Grid<float>& heights, const std::vector<std::size_t>& region);

}  // namespace debulk
