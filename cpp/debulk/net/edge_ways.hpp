#pragma once

#include <array>
#include <vector>

#include "debulk/net/net.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// mm in XY from each node to the nearest point of the ply's edge.
std::vector<double> ways_to_edge(const Net& net, const Polygon& ply);

// For each node and each of its two fibres, mm in XY: the way straight on from an end of the fibre to the ply's edge, of its two
// ends the lesser. Over that way friction holds a fibre that is pulled towards the pocket; 0 for a fibre of a single node.
std::vector<std::array<double, 2>> ways_along_fibres(const Net& net, const Polygon& ply);

// For each node, mm in XY: the way straight on to the ply's edge from a fibre that ends at it, of two such the longer; 0 at a node
// where no fibre ends.
std::vector<double> ways_past_ends(const Net& net, const Polygon& ply);

}  // namespace debulk
