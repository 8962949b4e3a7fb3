#pragma once

#include <Eigen/Core>

#include "debulk/section/profile.hpp"

namespace debulk {

// What the ply's section starts from, lengths in any one unit: it lies on the mold but for one smooth bump in the middle, its
// crown on x = 0. Each side of the crown has half the segments and takes half of the excess.
struct SectionStart {
  Eigen::VectorXd lengths;  // of the segments: one length a side
  Eigen::Matrix2Xd line;    // (x, z) of the nodes
};

// `half_span`: the pins stand at x = -half_span and half_span. `segments`: even. `bump`: arc length that the bump should have; it
// takes as many whole segments, between twice the excess and the whole ply.
SectionStart section_start(const SectionProfile& mold, double half_span, double excess, int segments, double bump);

}  // namespace debulk
