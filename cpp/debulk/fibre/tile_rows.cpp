#include "debulk/fibre/tile_rows.hpp"

#include <limits>

#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

// The sum of `count` rows of kTileStride floats, each `apart` behind the one before. Every point is summed afresh:
// with running sums the rounding would depend on where the tile begins.
DEBULK_WIDE void add_rows(const float* __restrict first, int count, int apart, float* __restrict out) {
  float sum[kTileStride];
  for (int i = 0; i < kTileStride; ++i) sum[i] = first[i];
  for (int k = 1; k < count; ++k)
    for (int i = 0; i < kTileStride; ++i) sum[i] += first[k * apart + i];
  for (int i = 0; i < kTileStride; ++i) out[i] = sum[i];
}

}  // namespace

DEBULK_WIDE RowCounts count_row(const float* heights, int count, float height) {
  RowCounts out;
  for (int i = 0; i < count; ++i) out.gaps += heights[i] == heights[i] ? 0 : 1, out.above += heights[i] > height ? 1 : 0;
  return out;
}

DEBULK_WIDE void copy_known(const float* __restrict heights, const std::uint8_t* __restrict on, int count, float* __restrict values,
                            float* __restrict known) {
  for (int i = 0; i < count; ++i) {
    const bool good = (heights[i] == heights[i]) & (on[i] != 0);
    values[i] = good ? heights[i] : 0.0F, known[i] = good ? 1.0F : 0.0F;
  }
}

void square_sums(const float* values, int border, int r, std::vector<float>& along, float* sums) {
  const int stride = kTileStride + 2 * border, rows = kTileSide + 2 * r, count = 2 * r + 1;
  along.resize(static_cast<std::size_t>(rows) * kTileStride);
  for (int j = 0; j < rows; ++j) add_rows(values + (j + border - r) * stride + border - r, count, 1, along.data() + j * kTileStride);
  for (int j = 0; j < kTileSide; ++j) add_rows(along.data() + j * kTileStride, count, kTileStride, sums + j * kTileStride);
}

DEBULK_WIDE void write_points(const TileRow& row, double thickness, float* __restrict points) {
  for (int i = 0; i < kTileSide; ++i) {
    const double fine = row.fine[i] / row.fine_count[i], coarse = row.coarse[i] / row.coarse_count[i];
    points[kEach * i] = static_cast<float>(fine - thickness);
    points[kEach * i + 1] = static_cast<float>(coarse - thickness);
    points[kEach * i + 2] = static_cast<float>(row.mold[i]);
    points[kEach * i + 3] = 0;
  }
  for (int i = 0; row.known != nullptr && i < kTileSide; ++i)
    if (!(row.known[i] > 0)) points[kEach * i] = points[kEach * i + 1] = std::numeric_limits<float>::quiet_NaN();
}

}  // namespace debulk
