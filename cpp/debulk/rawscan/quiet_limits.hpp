#pragma once

#include <vector>

#include "debulk/core/stop.hpp"
#include "debulk/rawscan/pixel_square.hpp"

namespace debulk {

constexpr float quiet_share = 0.7f;  // of a quiet square's fourth differences are low; of noise 0.05 are

// The steps to which a scan's depths were rounded.
struct Rounding {
  float step = 0;        // mm at `depth`; 0: no steps are seen
  float depth = 0;       // depth of the scan's middle, along the scanner's z
  bool squared = false;  // the step grows with the depth squared, as the steps of a disparity do

  float at(float here) const { return squared ? step * (here / depth) * (here / depth) : step; }
};

// Limits below which a square of pixels carries no noise of its scan, along one axis.
struct QuietLimits {
  Eigen::Vector3f axis = Eigen::Vector3f::UnitZ();
  // Fourth differences up to this (mm) are low. 0: the scan has too little noise, or too coarse steps, to use them.
  float difference = 0;
  // If the depths were rounded, the differences of a smooth surface are large, too. But rounding moves no point by
  // more than half a step.
  Rounding rounding;
  float scatter = 0;  // median over squares of the root mean square about their cubics, mm
  bool stepped = false;
  // Greatest share of a quiet square's pixels farther than `bound` from its cubic. 0: the steps hide so much of the
  // noise that squares with and without it cannot be distinguished, or there are no steps that matter.
  float share = 0;
  // Used where steps hide the noise: heights that differ by more than this (mm) are two levels. What was filled in
  // after the rounding has many levels between two steps. 0: not used.
  float level = 0;

  bool told() const { return stepped ? share > 0 : difference > 0; }
  float bound(float depth) const;
};

// Determines the limits along each axis from squares of the scan that are known to lie on the ply. Throws InputError
// on a square that does not exist, and Stopped.
std::vector<QuietLimits> quiet_limits(const SquareLattice& lattice, const std::vector<int>& squares,
                                      const std::vector<Eigen::Vector3f>& axes, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
