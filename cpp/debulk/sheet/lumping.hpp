#pragma once

#include <vector>

#include "debulk/net/net.hpp"

namespace debulk {

// How vacuum, weight and friction, which act on areas, are shared out to nodes (docs/model.md, section 3).
enum class Lumping {
  consistent,  // by the net's own cells: the sum is that of the surface, whatever the spacing
  paper,       // A / N to every node: A inside the perimeter, N with the band outside it, so that it depends on the spacing
};

// mm2 of ply that each node stands for. Consistent: a quarter of each adjoining cell, a corner between two of its fibres at a
// time, as the shear has it: |a x b| / 4. A net without any corner is a single fibre and has no width: there it is A / N too.
std::vector<double> nodal_areas(const Net& net, Lumping lumping, double area_mm2);

// mm2 of ply whose friction holds each of these free nodes. Consistent: the strip, one spacing wide, from it to the ply's edge
// (`Net::to_edge`); where that is not known, as if the edge were half a spacing away.
std::vector<double> gripping_areas(const Net& net, const std::vector<int>& free, Lumping lumping, double area_mm2);

}  // namespace debulk
