#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/net/net.hpp"

namespace debulk {

// A cross-section of a hill along one fibre: from its top down on both sides, on each to the foot (where the ply
// touches the mold), to the valley before the next hill, or to the net's border, whichever comes first.
struct FibreSection {
  int peak = -1;             // the node at the top
  int fibre = 0;             // 0: along the first fibre (west to east), 1: along the second (south to north)
  std::vector<int> nodes;    // from one end to the other, at least two; at the net's border the peak may be an end node
  double ply_length = 0.0;   // mm
  double mold_length = 0.0;  // mm, along the closest points of the nodes on the mold

  double excess() const { return ply_length - mold_length; }  // mm
  double excess_per_length() const { return excess() / ply_length; }
};

// The net at the minimum, from which the sections are cut.
struct DebulkedNet {
  const std::vector<Eigen::Vector3d>& nodes;  // mm, at the minimum
  const std::vector<Eigen::Vector3d>& feet;   // mm, their closest points on the mold
  const std::vector<double>& gaps;            // mm, z - F(x, y)
  const std::vector<Neighbours>& neighbours;
};

// Returns the section through `peak` along a fibre, or nullopt if the fibre continues to a higher node: then `peak` is
// on a flank. `touch` (mm): a node no higher than this touches the mold, and a rise by no more than this is not another
// hill.
std::optional<FibreSection> fibre_section(const DebulkedNet& net, int peak, int fibre, double touch);

}  // namespace debulk
