#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Medians of squares of `side` by `side` cells, at the squares' middles. The last row and column of squares may be
// cut. NaN where fewer than a quarter of a whole square's cells have a value. Single spikes leave no trace.
Grid<float> pooled_medians(const Grid<float>& values, int side, int threads = 0, const Stop& stop = Stop());

// 1 for the nodes that are not farther than `reach_mm`, along x and along y, from a marked square.
Grid<std::uint8_t> nodes_near(const Grid<std::uint8_t>& squares, const Grid<double>& nodes, double reach_mm);

// Number of cells along the side of a square of about 2 mm, half the distance between the reference's nodes.
int pool_side(const Grid<float>& values);

}  // namespace debulk
