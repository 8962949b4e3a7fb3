#pragma once

#include <optional>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/pocket/hump_tops.hpp"

namespace debulk {

// What stands above the surface through the ring round a top.
struct HumpShape {
  double height;  // mm, of the top
  double area;    // mm2 that stand above half of that
  double excess;  // mm by which the longest of the fibres across it is longer than that surface; on a flank not the one over the top
};

// Measures a hump of a radius in cells along fibres at each of the angles (degrees); nothing if its surroundings are not smooth.
std::optional<HumpShape> hump_shape(const Grid<float>& map, const HumpTop& top, double radius, const std::vector<double>& angles);

}  // namespace debulk
