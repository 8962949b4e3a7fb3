#pragma once

#include <optional>

#include <Eigen/Core>

#include "debulk/surface/surface.hpp"

namespace debulk {

// A circle of points middle + radius (cos phi out + sin phi up), with unit vectors out and up, up.z >= 0.
struct Circle {
  Eigen::Vector3d middle, out, up;
  double radius;
};

// Returns the point at which a circle meets the surface, the nearest to phi = 0, to 1e-14 of `spacing` in height.
// Returns nullopt if there is none within 2.6 radians, or if the surface ends before.
std::optional<Eigen::Vector3d> where_circle_meets(const Surface& surface, const Circle& circle, double spacing);

// Returns the fourth corner x of the cell common - a - x - b: the point of the surface at distance `spacing` from a and
// b other than `common`, which is also at that distance from both. Returns nullopt if the cell is locked (2 degrees from
// closing) or no such point of the surface is found.
std::optional<Eigen::Vector3d> fourth_node(const Surface& surface, const Eigen::Vector3d& common, const Eigen::Vector3d& a,
                                           const Eigen::Vector3d& b, double spacing);

// Returns whether the cell common - a - fourth - b, seen from above, folds over. side: positive if the way from a to b
// round `common` is counter-clockwise in a cell that does not.
bool folds_over(const Eigen::Vector3d& common, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& fourth,
                double side);

}  // namespace debulk
