#include "debulk/solve/certificate.hpp"

#include <sstream>

namespace debulk {

std::string Certificate::failure() const {
  std::ostringstream why;
  const auto add = [&](const char* what, double came, const char* relation, double limit) {
    why << (why.tellp() > 0 ? ", " : "") << what << ' ' << came << relation << limit;
  };
  // The comparisons are written so that a NaN fails.
  if (!(length_error <= compliant_length_limit)) add("length error", length_error, " above ", compliant_length_limit);
  if (!(penetration_mm <= penetration_limit_mm)) add("penetration", penetration_mm, " mm above ", penetration_limit_mm);
  if (!(kkt_error <= kkt_limit)) add("first-order residual", kkt_error, " above ", kkt_limit);
  if (!(energy_gain_mj <= 0)) add("energy", energy_gain_mj, " mJ above the start's, not ", 0.0);
  if (!(curvature >= curvature_limit)) add("curvature", curvature, " below ", curvature_limit);
  return why.str();
}

}  // namespace debulk
