#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// Where the fold of a pocket runs, mold XY, mm.
struct ExcessCrest {
  std::vector<Eigen::Vector2d> line;      // from end to end
  std::vector<Eigen::Vector2d> mirrored;  // the same along the other diagonal of the fibres, where that is as likely; else empty
  int peak = 0;                           // node of the laid net through which both run: the highest of the fibre with the most to spare
};

// The crest that the excess of a pocket's fibres makes, from the laid net alone (docs/verdicts.md).
//
// A fold takes up the excess of every fibre that it crosses. Across a straight crest the ply rises to w(n), n along its normal; a fibre
// at the angle a to that normal has the length of w(s cos a) to spare, cos a times what the section along the normal holds. So where
// fibres of both directions have some to spare, e1 and e2, one crest serves both: its normal lies at atan(e2 / e1) from the first fibre,
// on either side. Followed from fibre to fibre that gives a curve.
//
// laid: with its lattice, its rim held. None where no fibre has anything to spare.
std::optional<ExcessCrest> excess_crest(const Net& laid, const Surface& mold);

}  // namespace debulk
