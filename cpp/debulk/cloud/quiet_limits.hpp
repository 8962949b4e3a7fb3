#pragma once

#include <vector>

#include "debulk/cloud/pixel_square.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

constexpr float quiet_share = 0.7f;  // of a square's fourth differences: of noise 0.05 are as low

// Steps to which a scan's depths were rounded.
struct Rounding {
  float step = 0;        // mm at `depth`; 0: none is seen
  float depth = 0;       // of the scan's middle, along the scanner's z
  bool squared = false;  // it grows with the depth squared, as the steps of a disparity do

  float at(float here) const { return squared ? step * (here / depth) * (here / depth) : step; }
};

// Below what a square of pixels carries none of its scan's noise, along one axis.
struct QuietLimits {
  Eigen::Vector3f axis = Eigen::Vector3f::UnitZ();
  // Fourth differences up to this, mm; 0: the scan has too little noise, or too coarse steps, to tell by them.
  float difference = 0;
  // Rounding hides what was smooth before: its differences are large. But it moves no point by more than half a step.
  Rounding rounding;
  float scatter = 0;  // median over squares of the root mean square about their cubics, mm
  bool stepped = false;
  // Share of a square's pixels farther than `bound` from its cubic, at most; 0: steps hide so much of the noise that squares with
  // it and without are not told apart, or there are no steps that matter.
  float share = 0;
  // Where steps hide the noise: heights that differ by more are two levels; what was filled in after the rounding has many
  // between two steps. 0: not looked at.
  float level = 0;

  bool told() const { return stepped ? share > 0 : difference > 0; }
  float bound(float depth) const;
};

// Limits along each axis, from squares of the scan that are known to lie on the ply. Throws Stopped.
std::vector<QuietLimits> quiet_limits(const SquareLattice& lattice, const std::vector<int>& squares,
                                      const std::vector<Eigen::Vector3f>& axes, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
