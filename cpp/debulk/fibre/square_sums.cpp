#include "debulk/fibre/square_sums.hpp"

// Compiled for several instruction sets, with which the compiler takes several points at a time. No sum changes its
// order.
#if defined(__x86_64__)
#define DEBULK_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define DEBULK_WIDE
#endif

namespace debulk {
namespace {

// The sum of `count` rows of kTileStride floats, each `apart` behind the one before. Every point is summed afresh:
// with running sums the rounding would depend on where the tile begins.
DEBULK_WIDE void add_rows(const float* __restrict first, int count, int apart, float* __restrict out) {
  float sum[kTileStride] = {};
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < kTileStride; ++i) sum[i] += first[k * apart + i];
  for (int i = 0; i < kTileStride; ++i) out[i] = sum[i];
}

}  // namespace

void square_sums(const float* values, int border, int r, std::vector<float>& along, float* sums) {
  const int stride = kTileStride + 2 * border, rows = kTileSide + 2 * r, count = 2 * r + 1;
  along.resize(static_cast<std::size_t>(rows) * kTileStride);
  for (int j = 0; j < rows; ++j) add_rows(values + (j + border - r) * stride + border - r, count, 1, along.data() + j * kTileStride);
  for (int j = 0; j < kTileSide; ++j) add_rows(along.data() + j * kTileStride, count, kTileStride, sums + j * kTileStride);
}

}  // namespace debulk
