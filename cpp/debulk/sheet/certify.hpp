#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/sheet/sheet.hpp"
#include "debulk/solve/certificate.hpp"

namespace debulk {

// Judges a configuration from its nodes alone, in mm and N, apart from any solver (docs/certificate.md, "What is certified").
// stiffness: that of the solve's compliance; used only where the lengths are off by more than the plain limit, when the
// multipliers of the lengths must be stiffness times strain instead of fitted ones.
struct Judged {
  Certificate certificate;
  bool complete = true;  // false: stopped before the residual and the curvature were known; kkt_error is then not a number
  // N, of each of Sheet::segments(): pull positive, 0 between fixed nodes. Empty where they are not known.
  std::vector<double> tensions_n;
  Points descent;  // where curvature is negative: a direction of it, largest component 1; else empty
};

// stop: when raised, what is not known yet is left out.
Judged certify(const Sheet& sheet, const Points& x, double stiffness, const Stop& stop = Stop());

}  // namespace debulk
