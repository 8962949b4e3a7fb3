#pragma once

#include <cstddef>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

struct DropOutOptions {
  double rim_mm = 0.5;      // at least one known height next to the component is this high
  double bridge_mm = 12.0;  // no point of the component lies further than half of this from a known height
};

// Whether a component of unknown heights (ascending indices) is a drop-out that may be bridged (segment.hpp), apart
// from the condition on the grid's border. The distance is counted in steps from neighbour to neighbour, diagonals
// too, through the component. Every point is looked at twice at most, however large the component is. `looked_at`, if
// given, receives how often a point was looked at. Throws Stopped.
bool is_drop_out(const Grid<float>& heights, const std::vector<std::size_t>& component, const DropOutOptions& options, const Stop& stop,
                 std::size_t* looked_at = nullptr);

}  // namespace debulk
