#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/surface/height_map.hpp"
#include "debulk/surface/reference_gaps.hpp"

namespace debulk {

// A coarse picture of what is known of the ply: every few points of a height map.
struct Overview {
  static constexpr double spacing_mm = 2.0;  // or less, unless the height map's is more

  Grid<float> heights;           // above the reference, mm; NaN: neither measured nor filled in
  Grid<std::uint8_t> measured;   // 1 where the scan saw the ply and the reference below it is known
  Grid<std::uint8_t> reference;  // 1 where the reference is known
};

Overview overview_of(const HeightMap& map, const ReferenceGaps& gaps);

}  // namespace debulk
