#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/sheet/sheet.hpp"
#include "debulk/solve/certificate.hpp"

namespace debulk {

// The result of certify().
struct Judged {
  Certificate certificate;
  bool complete = true;  // false: stopped before the residual and the curvature were known; kkt_error is then not a number
  // The tension of each of Sheet::segments(), N; pull is positive; 0 between fixed nodes. Empty if it is not known.
  std::vector<double> tensions_n;
  Points descent;  // if the curvature is negative, a direction of negative curvature, largest component 1; else empty
};

// Judges a configuration from its nodes alone, in mm and N, independently of any solver (docs/certificate.md, "What is
// certified"). stiffness: that of the solve's compliance. It is used only if the length error exceeds the plain limit;
// then the multipliers of the lengths must be stiffness times strain and are not fitted. stop: when it is raised, the
// values that are not known yet are left out.
Judged certify(const Sheet& sheet, const Points& x, double stiffness, const Stop& stop = Stop());

}  // namespace debulk
