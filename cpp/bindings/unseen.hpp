#pragma once

#include <array>
#include <optional>
#include <tuple>

#include "bindings/convert.hpp"
#include "debulk/pocket/unseen.hpp"

namespace debulk {

// Heights that a reference was fitted to: values, origin, spacing.
using SeenArray = std::tuple<Array<float>, std::array<double, 2>, double>;

inline std::optional<Grid<float>> seen_grid(const std::optional<SeenArray>& seen) {
  if (!seen) return std::nullopt;
  const auto& [values, origin, spacing] = *seen;
  return to_grid(values, Eigen::Vector2d(origin[0], origin[1]), spacing, "seen");
}

inline UnseenOptions unseen_options(double area_tol_mm2, double fill_mm, const std::optional<Array<double>>& ply_outline) {
  UnseenOptions options;
  options.area_tol_mm2 = area_tol_mm2, options.fill_mm = fill_mm;
  if (ply_outline) options.ply_outline = points<2>(*ply_outline, "ply_outline");
  return options;
}

}  // namespace debulk
