#pragma once

#include <limits>
#include <vector>

#include "debulk/core/stop.hpp"
#include "debulk/net/lay.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// A straight line along a fibre over a pocket's foot, from its first point on the foot to its last.
struct StraightFibre {
  double excess = 0;  // mm, excess of the ply's lower side over the mold, along the steps whose ends both lie on the foot
  std::vector<Eigen::Vector2d> points;
  std::vector<double> gaps;   // mm, height of the ply's lower side above the mold; 0 where it is not known, NaN off the foot
  std::vector<double> molds;  // mm, heights of the mold; NaN off the foot
};

// The conditions under which a line is held. It counts only if the ply continues for the distance `over` beyond both of
// its ends. If the ply lies on the mold over a distance longer than `apart`, friction holds it there, and the parts on
// both sides are lines of their own.
struct LinesHeld {
  Polygon ply;                                             // outline of the ply; empty: the ply continues everywhere
  double over = 0;                                         // mm
  double apart = std::numeric_limits<double>::infinity();  // mm
};

// Measures straight lines along the fibres and returns for each direction the one with the largest excess; it has no
// points if there is no excess. On a wide pocket, a net of some hundred nodes has fibres 10 to 30 mm apart, and they
// miss a narrow bump on it. These lines are a few millimetres apart, and their lengths come from the heights
// themselves. Throws Stopped.
std::vector<StraightFibre> straight_fibres(const FootMap& feet, const Foot& foot, const Surface& mold, const FibreAngles& angles,
                                           const LinesHeld& held, const Stop& stop = Stop());

}  // namespace debulk
