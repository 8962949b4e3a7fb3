#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/surface/height_map.hpp"
#include "debulk/surface/reference_gaps.hpp"

namespace debulk {

// A coarse picture of what is known of the ply: every few points of a height map.
struct Overview {
  static constexpr double spacing_mm = 2.0;  // about

  Grid<float> heights;           // above the reference, mm; NaN: neither measured nor filled in
  Grid<std::uint8_t> measured;   // 1 where the scan saw the ply and the reference below it is known
  Grid<std::uint8_t> reference;  // 1 where the reference is known

  // Of a grid with this spacing, every step()-th point is taken.
  static int step(double grid_spacing_mm);
};

// anchor: the first point of a larger grid with the same lines. Points are taken as if the map began there, so that a
// part of the larger grid shows what the whole shows.
Overview overview_of(const HeightMap& map, const ReferenceGaps& gaps, const Eigen::Vector2d& anchor);

}  // namespace debulk
