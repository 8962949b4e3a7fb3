#pragma once

#include <Eigen/Core>

#include "debulk/section/profile.hpp"

namespace debulk {

// The configuration from which the ply's section starts; lengths may be in any unit. The ply lies on the mold except
// for one smooth bump in the middle, with its crown on x = 0. Each side of the crown has half the segments and half of
// the excess.
struct SectionStart {
  Eigen::VectorXd lengths;  // of the segments; equal on each side
  Eigen::Matrix2Xd line;    // (x, z) of the nodes
};

// `half_span`: the pins are at x = -half_span and half_span. `segments`: must be even. `bump`: arc length that the bump
// should have; it is rounded to whole segments and limited to between twice the excess and the whole ply.
SectionStart section_start(const SectionProfile& mold, double half_span, double excess, int segments, double bump);

}  // namespace debulk
