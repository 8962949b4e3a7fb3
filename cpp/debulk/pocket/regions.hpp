#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// Foreground is connected over 8 neighbours, background over 4: two diagonal foreground points join, and a background
// region cannot leak between them. Every outline here follows the same rule.

// Background regions that do not reach the grid's border become foreground (MATLAB's imfill; paper, segmentation).
// foreground: nonzero or 0. Returns the filled image.
Grid<std::uint8_t> fill_holes(const Grid<std::uint8_t>& foreground);

// Labels from 1 in order of each component's first point, row by row; 0 for background. Sets `count`.
Grid<std::int32_t> connected_components(const Grid<std::uint8_t>& foreground, int& count);

}  // namespace debulk
