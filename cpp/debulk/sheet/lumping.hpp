#pragma once

#include <vector>

#include "debulk/net/net.hpp"

namespace debulk {

// How vacuum, weight and friction, which act on areas, are distributed to the nodes (docs/model.md, section 3).
enum class Lumping {
  consistent,  // by the net's own cells: the sum is the area of the surface, whatever the spacing
  paper,       // A / N per node. A is the area inside the perimeter, but N includes the band outside: it depends on the spacing
};

// Returns the area of ply, mm2, that each node represents. Consistent: a quarter of each adjoining cell, |a x b| / 4
// for each corner between two of its fibres, as in the shear. A net without any corner is a single fibre and has no
// width; its nodes get A / N as well.
std::vector<double> nodal_areas(const Net& net, Lumping lumping, double area_mm2);

// Returns the area of ply, mm2, whose friction holds each of these free nodes. Consistent: the strip, one spacing wide,
// from the node to the ply's edge (`Net::to_edge`); if the edge is not known, it is taken to be half a spacing away.
std::vector<double> gripping_areas(const Net& net, const std::vector<int>& free, Lumping lumping, double area_mm2);

}  // namespace debulk
