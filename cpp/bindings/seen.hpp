#pragma once

#include <array>
#include <optional>
#include <tuple>

#include "bindings/convert.hpp"

namespace debulk {

// The heights to which a reference was fitted: values, origin, spacing.
using SeenArray = std::tuple<Array<float>, std::array<double, 2>, double>;

inline std::optional<Grid<float>> seen_grid(const std::optional<SeenArray>& seen) {
  if (!seen) return std::nullopt;
  const auto& [values, origin, spacing] = *seen;
  return to_grid(values, Eigen::Vector2d(origin[0], origin[1]), spacing, "seen");
}

}  // namespace debulk
