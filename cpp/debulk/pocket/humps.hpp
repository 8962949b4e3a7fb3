#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// A hump of a surface on smooth surroundings: a quadratic surface, or one that is straight in one direction with any
// profile across, as a spar's is. Pockets of a ply look so, and bosses of a mold.
struct Hump {
  Eigen::Vector2d top = Eigen::Vector2d::Zero();  // mm
  double height = 0;                              // mm above the surface that its surroundings predict
  double area = 0;                                // mm2 of what stands above half of that
  double excess = 0;                              // mm by which the longest of the fibres across it is longer than that surface
  double cell = 0;                                // mm: side of the squares over whose means it was measured
};

// Finds the humps on a ply, of radii from some 10 to 100 mm; some are found twice. Their excess is that of fibres at any
// of the angles (degrees). Heights that are not known are NaN; an empty ply has no edge. Throws Stopped.
std::vector<Hump> find_humps(const Grid<float>& seen, const Polygon& ply, const std::vector<double>& angles, const Stop& stop = Stop());

}  // namespace debulk
