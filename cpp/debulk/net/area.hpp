#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/surface/surface.hpp"

namespace debulk {

// Area in mm^2 of the surface (not of its projection) inside the outline and, where one is given, inside the ply's outline
// too. Midpoint rule on about 10000 points; exact on a plane without a ply outline.
double surface_area(const Surface& surface, const std::vector<Eigen::Vector2d>& outline,
                    const std::vector<Eigen::Vector2d>& ply_outline = {});

}  // namespace debulk
