#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"

namespace debulk {

// Gives each point every mark (a bit of a value) of the points within `reach` points along x and y, and keeps its own.
Grid<std::uint8_t> dilate(const Grid<std::uint8_t>& marks, int reach);

}  // namespace debulk
