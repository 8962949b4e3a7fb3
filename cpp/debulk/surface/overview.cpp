#include "debulk/surface/overview.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {

int Overview::step(double grid_spacing_mm) {
  return std::max(1, static_cast<int>(std::lround(spacing_mm / grid_spacing_mm)));
}

Overview overview_of(const HeightMap& map, const ReferenceGaps& gaps, const Eigen::Vector2d& anchor) {
  const Grid<float>& fine = map.heights;
  const int step = Overview::step(fine.spacing);
  const auto first = [&](int axis) {
    const int beyond = static_cast<int>(std::lround((fine.origin[axis] - anchor[axis]) / fine.spacing)) % step;
    return (step - beyond) % step;
  };
  const int i0 = std::min(first(0), fine.nx - 1), j0 = std::min(first(1), fine.ny - 1);
  Overview out;
  out.heights = Grid<float>((fine.nx - 1 - i0) / step + 1, (fine.ny - 1 - j0) / step + 1, fine.position(i0, j0), step * fine.spacing);
  out.measured = out.reference = out.heights.like<std::uint8_t>();
  for (int j = 0; j < out.heights.ny; ++j)
    for (int i = 0; i < out.heights.nx; ++i) {
      out.heights.at(i, j) = fine.at(i0 + i * step, j0 + j * step);
      out.measured.at(i, j) = map.measured.at(i0 + i * step, j0 + j * step);
      out.reference.at(i, j) = gaps.known(i0 + i * step, j0 + j * step);
    }
  return out;
}

}  // namespace debulk
