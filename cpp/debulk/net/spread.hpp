#pragma once

#include <functional>

#include <Eigen/Core>

#include "debulk/net/lay.hpp"

namespace debulk {

// Lays a net outwards from its centre: calls visit(i, j, node) for the centre and for each neighbour, once, of the nodes
// for which it returned true. Besides the visited nodes, only those are laid from which they are laid.
void spread(NetLayer& layer, const std::function<bool(int i, int j, const Eigen::Vector3d& node)>& visit);

}  // namespace debulk
