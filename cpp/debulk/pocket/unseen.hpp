#pragma once

#include <optional>
#include <vector>

#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/overview.hpp"

namespace debulk {

struct UnseenOptions {
  double area_tol_mm2 = 200.0;         // holes up to this area are only summed
  double fill_mm = 20.0;               // the rule for small holes: no wider than this along x and y, they are filled in
  std::optional<Polygon> ply_outline;  // mold XY, mm; none: unknown, and the reference stands for it
};

// A part of the ply that was not seen.
struct UnseenHole {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  // of its area, mm; where that lies off it, as of a bent one, the nearest point in it
  Box box;
  double area = 0;       // mm2
  double thickness = 0;  // twice the greatest distance of a point in it from a known height of the ply, mm
  // Height beside it that a twentieth of its rim's points reach, but at least three of them (no single wild one decides) and at
  // most eight (16 mm of a long rim stand up where a pocket of the tolerances is cut). 0: fewer are known.
  double rim_height = 0;
  // The same without specks, which are pieces of fewer than 3 by 3 known points, as strays in a glare are; with them where they are
  // most of the rim.
  double outer_rim_height = 0;
  double reference_share = 0;  // share of its area where it is the reference that is not known
  bool at_ply_edge = false;    // reaches the ply's outline, or the border of what the scanner sees
  bool filled = false;         // small enough for the rule: heights are there, but were not measured
};

struct Unseen {
  double coverage = 0;            // share of the ply that is measured or filled in; what lies off the grid is not
  double reference_coverage = 0;  // the same of the reference alone
  std::vector<UnseenHole> holes;  // above the area tolerance, largest first; filled ones of at least half of it, last
  int smaller = 0;                // number of the other holes that are not filled in ...
  double smaller_area = 0;        // ... and their area, mm2
};

Unseen find_unseen(const Overview& overview, const UnseenOptions& options);

}  // namespace debulk
