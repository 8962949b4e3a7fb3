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
  std::vector<Eigen::Vector2d> rms_outline;  // decides Net::inside; empty: `outline` does
};

// As many nodes at least are to lie inside the outline at the cut: fewer do not show how a pocket closes.
inline constexpr int kLeastNodesInside = 25;

struct FibreNetOptions {
  // mm; none: chosen so that the net has about node_target nodes, and more where fewer than kLeastNodesInside of these would lie
  // inside rms_outline, up to three times as many
  std::optional<double> spacing;
  int node_target = 100;                // all nodes of the net count
  double edge_tol = 20.0;               // mm from the ply's edge within which boundary nodes are free
  double mold_tol = kNominalMoldTolMm;  // mm between surface and mold within which a band node is a boundary node
  PathRule paths = PathRule::geodesic;
  bool finer_too = false;  // PocketNet::finer

  void check() const;
};

struct PocketNet {
  Net net;
  double area = 0.0;           // mm^2 of ply surface inside the perimeter (and the ply)
  std::vector<int> open_ends;  // inner nodes away from the ply's edge that miss a fibre neighbour: the rim is not closed there
  std::vector<std::array<double, 2>> hold_ways;  // ways_along_fibres(); empty where the ply's edge is not known
  std::vector<double> past_ends;                 // ways_past_ends(); empty where no node is free, too; 0 of a node off the mold
  // The net at half the spacing: empty where it was not asked for, a node is free, its rim does not close, or none can be laid. It is
  // there for its lengths: without ways to the ply's edge.
  Net finer;
  double noise = 0.0;  // of lay_pocket() alone: the scan's in the height of a node, mm, one standard deviation

  bool held_all_round() const { return std::count(net.kinds.begin(), net.kinds.end(), NodeKind::free) == 0; }
};

// The pocket's net on the ply's surface (docs/model.md, section 2). Its nodes: inside the perimeter, and in the band up to one
// spacing outside it (in XY), and not past the ply's edge; of these, the nodes that are connected to the centre.
//  * A band node within mold_tol of the mold is a boundary node: free within edge_tol of the ply's edge, else fixed.
//  * A node that lost a fibre neighbour to the ply's edge is the end of a fibre there: free, unless it is such a fixed node.
//  * All others are inner, band nodes above mold_tol too; but one that lost a fibre neighbour, and lies within mold_tol of the mold, is
//    a boundary node as if it lay in the band.
//  * An inner node on a single segment (none but a band node can be) is a loose pendulum: pressure and gravity on it say
//    nothing about the pocket, so it is taken away, again and again until none is left. A fixed node on a single segment is a
//    clamp at its fibre's end, a free one a fibre's end at the ply's edge: both stay.
PocketNet fibre_net(const Surface& ply, const Surface& mold, const PocketShape& shape, const FibreNetOptions& options = {},
                    const Stop& stop = Stop());  // throws Stopped

}  // namespace debulk
