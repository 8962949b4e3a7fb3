#pragma once

#include "debulk/section/problem.hpp"
#include "debulk/solve/certificate.hpp"

namespace debulk {

// The balance of a section's configuration, computed from its nodes alone: the forces that balance it best, and the
// residual. Lengths are in the problem's unit, forces per unit of width in P times that unit.
struct SectionBalance {
  double end_force = 0;     // thrust on the pins along x, the mean of both
  double guide_force = 0;   // force along x that holds the crown on x = 0
  double height = 0;        // largest gap to the mold
  double foot_width = 0;    // along x, between the points where the ply leaves the mold; the pins' distance if it nowhere touches
  int folds = 0;            // number of places where the ply stands higher than a tenth of `height`
  Certificate certificate;  // kkt_error in units of the load on a segment; penetration in the unit, not in mm; energy not set
};

// `touch`: gaps up to this may carry a contact force.
SectionBalance balance_section(const SectionProblem& problem, const Eigen::VectorXd& y, double touch);

}  // namespace debulk
