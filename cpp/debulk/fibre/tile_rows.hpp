#pragma once

#include <cstdint>
#include <vector>

namespace debulk {

// Points in a row of a tile, and floats in a row of its sums: a multiple of the lanes of the wide registers.
constexpr int kTileSide = 33;
constexpr int kTileStride = 40;
constexpr int kEach = 4;  // floats of a point of a tile, so that one register takes all: finer gap, coarser gap, mold and nothing

// What a row of heights holds: points that are not known, and points above a height.
struct RowCounts {
  int gaps = 0, above = 0;
};
RowCounts count_row(const float* heights, int count, float height);

// Sets heights, 0 where they are not known or not `on`, and whether they are known, 1 or 0.
void copy_known(const float* heights, const std::uint8_t* on, int count, float* values, float* known);

// Sums over the square of 2 r + 1 points around each point of a tile. `values` has the tile with `border` points all
// round, at least r, in kTileSide + 2 border rows of kTileStride + 2 border; `sums` gets kTileSide rows of kTileStride.
// Behind the points of a row both may hold anything. `along` is memory for the sums along the rows.
void square_sums(const float* values, int border, int r, std::vector<float>& along, float* sums);

// One row of a tile: sums and the numbers of points in them at either scale, whether the points are known (null: all are),
// and the mold.
struct TileRow {
  const float *fine, *fine_count, *coarse, *coarse_count, *known;
  const double* mold;
};
// Writes the kEach floats of each point; the gaps of points that are not known are NaN.
void write_points(const TileRow& row, double thickness, float* points);

}  // namespace debulk
