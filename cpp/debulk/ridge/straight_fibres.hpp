#pragma once

#include <limits>
#include <vector>

#include "debulk/core/stop.hpp"
#include "debulk/net/lay.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// A straight line along a fibre over a pocket's foot, from the first of its points there to the last.
struct StraightFibre {
  double excess = 0;  // mm, of the ply's lower side over the mold, along the steps whose ends both lie on the foot
  std::vector<Eigen::Vector2d> points;
  std::vector<double> gaps;   // mm, of the ply's lower side above the mold, 0 where that is not known; NaN off the foot
  std::vector<double> molds;  // mm, heights of the mold; NaN off the foot
};

// A line counts only where the ply goes on over a way beyond both of its ends. Over a longer way on the mold friction holds it apart: on
// either side of that it is a line of its own.
struct LinesHeld {
  Polygon ply;                                             // outline; empty: the ply goes on everywhere
  double over = 0;                                         // mm
  double apart = std::numeric_limits<double>::infinity();  // mm
};

// A net of some hundred nodes has fibres 10 to 30 mm apart on a wide pocket, and steps over a bump that rides on it. These lines stand
// a few millimetres apart, and are as long as the heights say. For each direction the one with the most excess; without excess
// it has no points. Throws Stopped.
std::vector<StraightFibre> straight_fibres(const FootMap& feet, const Foot& foot, const Surface& mold, const FibreAngles& angles,
                                           const LinesHeld& held, const Stop& stop = Stop());

}  // namespace debulk
