#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/components.hpp"
#include "debulk/pocket/ply_mask.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// The border of one labelled component, below the grid's resolution.
//
// The paper traces the pixels of the binary image (Moore neighbours); we march squares over the heights instead, because
// a pixel outline's area is off by a fraction of perimeter times spacing, this one's by the square of the spacing. Where no
// height tells where the border runs, it follows the pixels' edges, half a spacing from the last point of the component.
struct Outline {
  Polygon polygon;              // counter-clockwise; outlines round holes are left out
  double volume = 0;            // integral of the heights over the component, mm3
  bool at_ply_edge = false;     // runs along the ply's outline somewhere ...
  bool at_unknown = false;      // ... along unknown heights ...
  bool at_grid_border = false;  // ... along the border of the grid ...
  bool at_neighbour = false;    // ... along points at or above the level that are not of this component
};

// Outlines of the components, labelled 1, 2 .. in `labels` (other values are no component), where `heights` cross `level`. Points of
// one component that touch only diagonally are joined, as in components.hpp.
std::vector<Outline> trace_outlines(const Components& components, const Grid<std::int32_t>& labels, const Grid<float>& heights,
                                    double level, const PlyMask& ply, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
