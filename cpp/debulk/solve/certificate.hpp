#pragma once

#include <string>

namespace debulk {

// What is known of a returned point from the point alone (docs/certificate.md, "What is certified"): first-order residual with
// multipliers fitted afresh, length error, penetration, energy against the start's, and the smallest curvature within the
// active constraints.
struct Certificate {
  static constexpr double kkt_limit = 1e-4;     // in force units: the vacuum's on a node, but for stiff plies (sheet.hpp)
  static constexpr double length_limit = 1e-4;  // in units of the spacing
  static constexpr double compliant_length_limit = 1e-3;
  static constexpr double penetration_limit_mm = 1e-3;
  static constexpr double curvature_limit = -1e-5;  // in units of the force unit over Delta (sheet.hpp)

  double kkt_error = 0.0;         // largest |dPi - J^T lambda - nu| over movable coordinates
  double strict_kkt_error = 0.0;  // the same in units of the vacuum on a node whatever the ply (its weight, without vacuum); no limit
  double length_error = 0.0;      // largest |length / spacing - 1|
  double penetration_mm = 0.0;    // deepest movable node below the mold
  double energy_gain_mj = 0.0;    // energy above the start's; an answer is not above
  double curvature = 0.0;         // smallest found; 0 where none is negative
  bool compliant = false;         // length error between the two limits: a compliance was needed

  bool certified() const { return failure().empty(); }
  // Why not, in a few words; empty where certified.
  std::string failure() const;
};

}  // namespace debulk
