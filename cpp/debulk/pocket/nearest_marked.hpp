#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// A vector in grid steps along x and y.
struct Offset {
  std::int16_t i = kNone, j = 0;
  static constexpr std::int16_t kNone = std::numeric_limits<std::int16_t>::max();
  bool found() const { return i != kNone; }
  int squared() const { return i * i + j * j; }
};

// The columns [begin, end) of a row.
struct Columns {
  int begin, end;
};

// For each row, the unmarked points that may have a mark within `reach`. The grid's other points need not be looked
// at.
std::vector<std::vector<Columns>> unmarked_within(const Grid<std::uint8_t>& marked, int reach);

// The vector from every point to (nearly) the nearest marked one, up to `reach` points away. Vectors are handed on
// from neighbour to neighbour, downwards and upwards.
Grid<Offset> nearest_marked(const Grid<std::uint8_t>& marked, const std::vector<std::vector<Columns>>& unmarked, int reach);

}  // namespace debulk
