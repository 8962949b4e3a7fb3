#pragma once

#include <array>
#include <vector>

#include "debulk/net/net.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// Returns the distance, mm in XY, from each node to the nearest point of the ply's edge.
std::vector<double> ways_to_edge(const Net& net, const Polygon& ply);

// Returns for each node and each of its two fibres the distance, mm in XY, from an end of the fibre straight on to the
// ply's edge; of the fibre's two ends the one with the shorter distance counts. Over that distance friction holds a
// fibre that is pulled towards the pocket. 0 for a fibre of a single node.
std::vector<std::array<double, 2>> ways_along_fibres(const Net& net, const Polygon& ply);

// Returns for each node the distance, mm in XY, to the ply's edge straight on along a fibre that ends at the node; if
// two fibres end there, the longer distance. 0 at a node where no fibre ends.
std::vector<double> ways_past_ends(const Net& net, const Polygon& ply);

}  // namespace debulk
