#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/surface/height_map.hpp"
#include "debulk/surface/reference_gaps.hpp"

namespace debulk {

// What is known of the ply at a glance: every few points of a height map.
struct Overview {
  static constexpr double spacing_mm = 2.0;  // about

  Grid<float> heights;           // above the reference, mm; NaN: neither measured nor filled in
  Grid<std::uint8_t> measured;   // 1 where the scan saw the ply and the reference below it is known
  Grid<std::uint8_t> reference;  // 1 where the reference is known

  // Of every how manieth point of a grid of that spacing.
  static int step(double grid_spacing_mm);
};

// anchor: the first point of a larger grid with the same lines; points are taken as if it was that one, so that a part of it shows
// what the whole shows.
Overview overview_of(const HeightMap& map, const ReferenceGaps& gaps, const Eigen::Vector2d& anchor);

}  // namespace debulk
