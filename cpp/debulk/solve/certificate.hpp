#pragma once

#include <string>

namespace debulk {

// The quality of a returned point, computed from the point alone (docs/certificate.md, "What is certified"): the
// first-order residual with newly fitted multipliers, the length error, the penetration, the energy relative to the
// start's, and the smallest curvature within the active constraints.
struct Certificate {
  static constexpr double kkt_limit = 1e-4;     // in force units: the vacuum's force on a node, except for stiff plies (sheet.hpp)
  static constexpr double length_limit = 1e-4;  // in units of the spacing
  static constexpr double compliant_length_limit = 1e-3;
  static constexpr double penetration_limit_mm = 1e-3;
  static constexpr double curvature_limit = -1e-5;  // in units of the force unit over Delta (sheet.hpp)

  double kkt_error = 0.0;         // largest |dPi - J^T lambda - nu| over movable coordinates
  double strict_kkt_error = 0.0;  // the same in units of the vacuum on a node for any ply (of its weight, without vacuum); no limit
  double length_error = 0.0;      // largest |length / spacing - 1|
  double penetration_mm = 0.0;    // deepest movable node below the mold
  double energy_gain_mj = 0.0;    // rise of the energy above the start's; it must be 0 in an answer
  double curvature = 0.0;         // smallest curvature found; 0 if none is negative
  bool compliant = false;         // length error between the two limits: a compliance was needed

  bool certified() const { return failure().empty(); }
  // Returns in a few words why the point is not certified; empty if it is.
  std::string failure() const;
};

}  // namespace debulk
