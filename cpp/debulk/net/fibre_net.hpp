#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/nominal_ply.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/net/lay.hpp"
#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// One pocket in the mold's XY plane, mm. Outlines are polygons closed implicitly.
struct PocketShape {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // inside the outline
  FibreAngles angles{0.0, 0.0};
  std::vector<Eigen::Vector2d> outline;      // the perimeter
  std::vector<Eigen::Vector2d> ply_outline;  // empty: the ply's edge is unknown and no node is free
  std::vector<Eigen::Vector2d> rms_outline;  // decides Net::inside; if it is empty, `outline` does
};

// The least number of nodes that should lie inside the outline at the cut: fewer do not show how a pocket closes.
inline constexpr int kLeastNodesInside = 25;

struct FibreNetOptions {
  // mm. Without a value, the spacing is chosen so that the net has about node_target nodes, or more (up to three times
  // as many) if fewer than kLeastNodesInside of them would lie inside rms_outline.
  std::optional<double> spacing;
  int node_target = 100;                // number of all nodes of the net
  double edge_tol = 20.0;               // mm from the ply's edge within which boundary nodes are free
  double mold_tol = kNominalMoldTolMm;  // mm between surface and mold within which a band node is a boundary node
  PathRule paths = PathRule::geodesic;

  void check() const;
};

struct PocketNet {
  Net net;
  double area = 0.0;           // mm^2 of ply surface inside the perimeter (and the ply)
  std::vector<int> open_ends;  // inner nodes away from the ply's edge without one of their fibre neighbours: the rim is open there
  std::vector<std::array<double, 2>> hold_ways;  // ways_along_fibres(); empty if the ply's edge is not known
  std::vector<double> past_ends;  // ways_past_ends(), 0 for a node off the mold; empty if the edge is not known or no node is free

  bool held_all_round() const { return std::count(net.kinds.begin(), net.kinds.end(), NodeKind::free) == 0; }
};

// Lays the pocket's net on the ply's surface (docs/model.md, section 2). Its nodes lie inside the perimeter or in the
// band up to one spacing outside it (in XY), and not past the ply's edge; only nodes connected to the centre are kept.
//  * A band node within mold_tol of the mold is a boundary node: free within edge_tol of the ply's edge, else fixed.
//  * A node that lost a fibre neighbour to the ply's edge is the end of a fibre there. It is free, unless it is such a
//    fixed node.
//  * All other nodes are inner nodes, including band nodes higher than mold_tol. But a node that lost a fibre neighbour
//    and lies within mold_tol of the mold is a boundary node, as if it lay in the band.
//  * An inner node on a single segment (only a band node can be one) is a loose pendulum: pressure and gravity on it
//    say nothing about the pocket. Such nodes are removed, repeatedly, until none is left. A fixed node on a single
//    segment is a clamp at its fibre's end, and a free one is a fibre's end at the ply's edge: both stay.
PocketNet fibre_net(const Surface& ply, const Surface& mold, const PocketShape& shape, const FibreNetOptions& options = {},
                    const Stop& stop = Stop());  // throws Stopped

}  // namespace debulk
