#pragma once

#include "debulk/section/problem.hpp"
#include "debulk/solve/certificate.hpp"

namespace debulk {

// What is known of a section's configuration from its nodes alone: the forces that balance it best, and what is left over.
// Lengths in the problem's unit, forces per width in units of P times that.
struct SectionBalance {
  double end_force = 0;     // thrust on the pins along x, the mean of both
  double guide_force = 0;   // that holds the crown on x = 0, along x
  double height = 0;        // largest gap to the mold
  double foot_width = 0;    // between the points where the ply leaves the mold, along x, or of the pins where all of it is up
  int folds = 0;            // places where the ply stands higher than a tenth of `height`
  Certificate certificate;  // kkt_error in units of the load on a segment; penetration in the unit, not mm; no energy
};

// `touch`: gaps up to this may carry a contact force.
SectionBalance balance_section(const SectionProblem& problem, const Eigen::VectorXd& y, double touch);

}  // namespace debulk
