#include "debulk/verdict/excess_rule.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/verdict/excess_bounds.hpp"

namespace debulk {

ExcessRidge ridge_by_excess(const ExcessLengths& lengths, double thickness, double bulk_factor, double margin) {
  require(std::isfinite(lengths.half_spacing) && lengths.half_spacing > 0, "half_spacing_mm", "a positive length in mm",
          lengths.half_spacing);
  require(std::isfinite(lengths.noise) && lengths.noise >= 0, "noise_mm", "a length in mm, or 0", lengths.noise);
  require(std::isfinite(lengths.noise_gain) && lengths.noise_gain >= 0, "noise_gain", "a number, not negative", lengths.noise_gain);
  require(std::isfinite(margin) && margin >= 0, "excess_margin_mm", "a length in mm, or 0", margin);
  const auto height = [&](double excess) { return ridge_by_formula(excess, thickness, bulk_factor); };

  ExcessRidge out;
  const double bias_at_half = lengths.segments * lengths.noise * lengths.noise / lengths.half_spacing;
  const double correction = (lengths.at_half - lengths.at_spacing) / 3;
  out.noise_bias = bias_at_half * 5 / 4;  // the bias at twice the spacing is a quarter of this; extrapolated like the excess
  out.excess = lengths.at_half + correction - out.noise_bias;
  out.height = height(out.excess);
  out.noise = std::hypot(lengths.noise_gain * lengths.noise, out.noise_bias) / 2;
  // If two spacings differ by as much as the finer one gives, they do not determine the limit.
  const double difference = std::abs(lengths.at_half - lengths.at_spacing);
  out.spacing_error = difference >= lengths.at_half ? difference : std::abs(correction) / 2;
  out.uncertainty = std::max(margin, std::hypot(2 * out.noise, out.spacing_error));
  out.range = {height(out.excess - 2 * out.uncertainty), height(out.excess + 2 * out.uncertainty)};
  return out;
}

}  // namespace debulk
