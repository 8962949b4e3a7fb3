#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// These functions define the length of the mold with which a piece of ply is compared (docs/model.md, section 5). The
// paper's L_mold is an arc length; the net's L_ply is a sum of chords. When chords are compared with chords, node for
// node, the discretisation cancels: a net that lies on a curved mold has exactly no excess. Chord and arc differ by
// spacing^3 / (24 R^2) per segment, which is 1e-4 mm at 8 mm and R = 450 mm.

// Returns the point of the surface nearest to `point` (the foot of the normal), searched from the point below it. The
// point below along z would not do: on a sloping mold a ridge leans off the vertical, and its projection along z would
// count the leaning as mold length.
Eigen::Vector3d closest_point(const Surface& surface, const Eigen::Vector3d& point);

// Returns the sum of the distances between consecutive points.
double polyline_length(const std::vector<Eigen::Vector3d>& points);

// Returns the nodes of each fibre, from one end to the other; fibres of the first direction come before those of the
// second.
std::vector<std::vector<int>> fibres(const std::vector<Neighbours>& neighbours);

// Returns the length of a fibre (at least two points) minus that of the mold, mm. The mold is measured between the
// closest points of the fibre's ends, along the straight line in XY, in as many chords as the fibre has. The result is
// negative if the ply is too short for its mold.
double fibre_excess(const std::vector<Eigen::Vector3d>& ply, const Surface& surface);

// Returns the largest excess of any fibre of the net, mm (fibre_excess()); 0 if no fibre is longer than its mold. It is
// an upper bound of the excess of every section of a fibre whose ends are held; a free end may slide and give more or
// less.
double largest_fibre_excess(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours, const Surface& surface);

// Throws InputError unless all nodes are finite and each has a row of neighbours that are in range and mutual (the west
// neighbour of its east neighbour is the node itself).
void check_nodes(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours);

}  // namespace debulk
