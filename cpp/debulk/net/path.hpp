#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "debulk/surface/surface.hpp"

namespace debulk {

// How the two initial fibre paths run on from the centre.
enum class PathRule {
  geodesic,        // straight within the surface
  vertical_plane,  // straight seen from above
};

// Where a net may go, in the mold's XY plane.
using NetDomain = std::function<bool(const Eigen::Vector2d&)>;

// Unit vector of the tangent plane at xy whose projection along z has the direction `angle` (radians, counter-clockwise
// from the mold's +x).
Eigen::Vector3d fibre_direction(const Surface& surface, const Eigen::Vector2d& xy, double angle);

// Nodes along a fibre from `start` (itself left out) along `angle`, each at chord distance `spacing` from the one before,
// to the last one in the region; at most `limit` nodes. Also ends where the surface does (a height that is not finite),
// and where it runs, seen from above, at a right angle to its start: beyond that it turns back.
std::vector<Eigen::Vector3d> fibre_path(const Surface& surface, const Eigen::Vector2d& start, double angle, double spacing, PathRule rule,
                                        const NetDomain& region, long limit);

}  // namespace debulk
