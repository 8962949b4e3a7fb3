#pragma once

#include <vector>

namespace debulk {

// Points in a row of a tile, and floats in a row of its sums: a multiple of the lanes of the wide registers.
constexpr int kTileSide = 33;
constexpr int kTileStride = 40;

// Sums over the square of 2 r + 1 points around each point of a tile. `values` has the tile with `border` points all
// round, at least r, in kTileSide + 2 border rows of kTileStride + 2 border; `sums` gets kTileSide rows of kTileStride.
// Behind the points of a row both may hold anything. `along` is memory for the sums along the rows.
void square_sums(const float* values, int border, int r, std::vector<float>& along, float* sums);

}  // namespace debulk
