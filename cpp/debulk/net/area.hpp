#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/surface/surface.hpp"

namespace debulk {

// Returns the area in mm^2 of the surface (not of its projection) inside the outline and, if one is given, also inside
// the ply's outline. It uses the midpoint rule on about 10000 points and is exact on a plane without a ply outline.
double surface_area(const Surface& surface, const std::vector<Eigen::Vector2d>& outline,
                    const std::vector<Eigen::Vector2d>& ply_outline = {});

}  // namespace debulk
