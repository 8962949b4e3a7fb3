#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// Which length of the mold a piece of ply is compared with (docs/model.md, section 5). The paper's L_mold is an arc length; the
// net's L_ply is a sum of chords. Comparing chords with chords, node for node, lets the discretisation cancel: a net that lies
// on a curved mold has exactly no excess. Chord and arc differ by spacing^3 / (24 R^2) a segment, 1e-4 mm at 8 mm and R = 450 mm.

// The point of the surface nearest to `point` (the foot of the normal), searched from the point below it. Not the point below
// along z: on a sloping mold a ridge leans off the vertical, and its z-projection would count the leaning as mold length.
Eigen::Vector3d closest_point(const Surface& surface, const Eigen::Vector3d& point);

// Sum of the distances of consecutive points.
double polyline_length(const std::vector<Eigen::Vector3d>& points);

// The nodes of each fibre, from one end to the other; fibres of the first direction before those of the second.
std::vector<std::vector<int>> fibres(const std::vector<Neighbours>& neighbours);

// The length of a fibre, at least two points, minus that of the mold between the closest points of its ends, along the
// straight line in XY, in as many chords as the fibre has; mm. Negative where the ply is too short for its mold.
double fibre_excess(const std::vector<Eigen::Vector3d>& ply, const Surface& surface);

// The largest excess of any fibre of the net, mm (fibre_excess). It bounds the excess of every section of a fibre
// whose ends are held; a free end may slide and give more or less. 0 when no fibre is longer than its mold.
double largest_fibre_excess(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours, const Surface& surface);

// Throws InputError unless the nodes are finite and each has its neighbours, in range and mutual (the east neighbour's west is the node).
void check_nodes(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours);

}  // namespace debulk
