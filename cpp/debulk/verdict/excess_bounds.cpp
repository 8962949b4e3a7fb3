#include "debulk/verdict/excess_bounds.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/ridge/ridge_height.hpp"

namespace debulk {
namespace {

constexpr double kFold = 1.3256;  // docs/model.md, section 6

void require_positive(double value, const char* argument, const char* expected) {
  require(std::isfinite(value) && value > 0, argument, expected, value);
}

}  // namespace

double ridge_by_formula(double excess_length, double thickness, double bulk_factor) {
  require(std::isfinite(excess_length), "excess_length_mm", "a length in mm", excess_length);
  require_positive(thickness, "thickness_mm", "a positive thickness in mm");
  require(std::isfinite(bulk_factor) && bulk_factor >= 1, "bulk_factor", "at least 1", bulk_factor);
  const double formula = ridge_height_of_excess(excess_length, thickness);
  return formula > thickness / bulk_factor ? formula : 0.0;
}

RidgeBounds excess_bounds(double excess_length, double thickness, double bulk_factor, double natural_length) {
  require(std::isfinite(excess_length), "excess_length_mm", "a length in mm", excess_length);
  require_positive(thickness, "thickness_mm", "a positive thickness in mm");
  require(std::isfinite(bulk_factor) && bulk_factor >= 1, "bulk_factor", "at least 1", bulk_factor);
  require_positive(natural_length, "natural_length_mm", "a positive length in mm");
  RidgeBounds bounds;
  if (excess_length <= 0) return bounds;
  bounds.geometric = ridge_by_formula(excess_length, thickness, bulk_factor);
  bounds.elastic = std::max(bounds.geometric, elastic_fold_height(excess_length, natural_length));
  return bounds;
}

double natural_length(double modulus, double thickness, double pressure) {
  require_positive(modulus, "modulus_mpa", "a positive modulus in MPa");
  require_positive(thickness, "thickness_mm", "a positive thickness in mm");
  require_positive(pressure, "pressure_mpa", "a positive pressure in MPa");
  return thickness * std::cbrt(modulus / (12 * pressure));
}

double elastic_fold_height(double excess_length, double natural_length) {
  require(std::isfinite(excess_length) && excess_length >= 0, "excess_length_mm", "a length in mm, or 0", excess_length);
  require_positive(natural_length, "natural_length_mm", "a positive length in mm");
  return kFold * natural_length * std::pow(excess_length / natural_length, 4.0 / 7.0);
}

}  // namespace debulk
