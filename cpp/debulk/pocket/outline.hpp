#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/components.hpp"
#include "debulk/pocket/ply_mask.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// The border of one labelled component, resolved more finely than the grid.
//
// The paper traces the pixels of the binary image (Moore neighbours). Here squares are marched over the heights
// instead, because the error of a pixel outline's area is a fraction of perimeter times spacing, and that of this
// outline's area goes with the square of the spacing. Where no height determines the border, it follows the pixels'
// edges, half a spacing from the last point of the component.
struct Outline {
  Polygon polygon;              // counter-clockwise, mm; outlines round holes are left out
  double volume = 0;            // integral of the heights over the component, mm3
  bool at_ply_edge = false;     // runs along the ply's outline somewhere ...
  bool at_unknown = false;      // ... along unknown heights ...
  bool at_grid_border = false;  // ... along the border of the grid ...
  bool at_neighbour = false;    // ... along points at or above the level that are not of this component
};

// Outlines, where `heights` cross `level`, of the components, which are labelled 1, 2 .. in `labels` (other values are
// no component). Points of one component that touch only diagonally are joined, as in components.hpp. Without volume, that is 0. Throws
// Stopped.
std::vector<Outline> trace_outlines(const Components& components, const Grid<std::int32_t>& labels, const Grid<float>& heights,
                                    double level, const PlyMask& ply, int threads = 0, const Stop& stop = Stop(), bool with_volume = true);

}  // namespace debulk
