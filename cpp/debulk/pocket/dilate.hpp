#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"

namespace debulk {

// Every mark (a bit of a value) within `reach` points along x and y, of the points themselves.
Grid<std::uint8_t> dilate(const Grid<std::uint8_t>& marks, int reach);

}  // namespace debulk
