#pragma once

#include <optional>
#include <vector>

#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/overview.hpp"

namespace debulk {

struct UnseenOptions {
  double area_tol_mm2 = 200.0;         // holes up to this area are only summed
  std::optional<Polygon> ply_outline;  // mold XY, mm; empty: unknown, and the reference stands for it
};

// A part of the ply that was not seen.
struct UnseenHole {
  // Centre of its area, mm. If that lies off the hole, as it may in a bent one, the nearest point in the hole.
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Box box;
  double area = 0;  // mm2
  // Twice the greatest distance of a point in it from a known height of the ply, mm; of one that was filled in a point's
  // width less, for its heights are those that its rim leads to.
  double thickness = 0;
  // The height beside it, in mm, that a twentieth of its rim's points reach, but at least three of them (so that no
  // single wild point decides) and at most eight (if the hole cuts a pocket of the tolerances, 16 mm of a long rim
  // stand up). 0 if fewer are known.
  double rim_height = 0;
  double reference_share = 0;  // share of its area where the reference is unknown
  bool at_ply_edge = false;    // reaches the ply's outline, or the border of what the scanner sees
  bool filled = false;         // small enough for the rule: heights are there, but were not measured
};

struct Unseen {
  double coverage = 0;            // share of the ply that is measured or filled in; ply off the grid is neither
  double reference_coverage = 0;  // the same for the reference alone
  // The holes above the area tolerance that are not too thin (over two points thick), largest first; then the filled
  // ones of at least half that area.
  std::vector<UnseenHole> holes;
  int smaller = 0;          // number of the other holes that are not filled in ...
  double smaller_area = 0;  // ... and their area, mm2
};

Unseen find_unseen(const Overview& overview, const UnseenOptions& options);

}  // namespace debulk
