#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// The line along which a pocket folds, mold XY, mm.
struct ExcessCrest {
  std::vector<Eigen::Vector2d> line;      // from end to end
  std::vector<Eigen::Vector2d> mirrored;  // the line along the other diagonal of the fibres, if that is as likely; else empty
  int peak = 0;                           // node of the laid net on both lines: the highest of the fibre with the largest excess
};

// Finds the crest that the excess of a pocket's fibres makes, from the laid net alone (docs/verdicts.md).
//
// A fold takes up the excess length of every fibre that it crosses. Across a straight crest the ply rises to w(n), with
// n along the crest's normal. A fibre at the angle a to the normal follows w(s cos a), whose excess is cos a times that
// of the section along the normal. So if fibres of both directions have an excess, e1 and e2, one crest takes up both:
// its normal lies at atan(e2 / e1) from the first fibre, on either side. Following this direction from fibre to fibre
// gives a curve.
//
// laid: must have its lattice and a held rim. Returns nullopt if no fibre has an excess.
std::optional<ExcessCrest> excess_crest(const Net& laid, const Surface& mold);

}  // namespace debulk
