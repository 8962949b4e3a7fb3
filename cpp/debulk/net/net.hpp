#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace debulk {

enum class NodeKind : std::uint8_t {
  inner = 0,  // moves, but may not pass through the mold
  fixed = 1,  // boundary node, held by the ply around the pocket
  free = 2,   // boundary node near the ply's edge, which moves against friction
};

// Neighbours of a node along its two fibres: east and west along the first, north and south along the second; -1 means
// none.
enum Direction { east = 0, west = 1, north = 2, south = 3 };
using Neighbours = std::array<int, 4>;

// A pin-jointed net: nodes at one spacing along two families of inextensible fibres (docs/model.md, section 2).
struct Net {
  std::vector<Eigen::Vector3d> nodes;  // mm, mold frame; every segment is `spacing` long
  std::vector<Neighbours> neighbours;  // one per node, consistent: neighbours[neighbours[i][east]][west] == i
  std::vector<NodeKind> kinds;         // one per node
  std::vector<std::uint8_t> inside;    // one per node: 1 inside the pocket's perimeter (the nodes that count in the RMS)
  double spacing = 0.0;                // mm
  std::vector<double> to_edge;         // mm in XY from each node to the ply's edge; empty if the edge is not known

  // Steps (i, j) along the first and the second fibre from the node at the centre, which is (0, 0).
  std::vector<std::array<int, 2>> lattice;  // one per node if the net was laid by NetLayer; else empty
};

// Returns the segments (i, j) with i < j along both fibres, in order of their first node, then direction.
std::vector<std::array<int, 2>> segments(const std::vector<Neighbours>& neighbours);

// Returns the largest difference between the numbers of two joined nodes.
int bandwidth(const std::vector<Neighbours>& neighbours);

// Returns for each node the mean of |90 degrees - crossing angle|, in radians, over its existing pairs of one neighbour
// from each fibre; 0 for a node without such a pair. The crossing angles are those in space.
std::vector<double> shear_angles(const Net& net);

}  // namespace debulk
