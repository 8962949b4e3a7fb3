// The loops of gap_tiles.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// Marks the tiles of one row of heights that hold a height above `high`, and those that hold one that is not known.
void look_over(const float* heights, int count, int tiles, float high, std::uint8_t* above, std::uint8_t* gaps) {
  static_assert(kTile == 2 * lanes);
  for (int tile = 0; tile < tiles; ++tile) {
    const float* h = heights + tile * kTile;
    const int n = std::min(kTileSide, count - tile * kTile);
    bool up = false, gap = false;
    if (n == kTileSide) {
      const Floats a = load(h), b = load(h + lanes);
      up = any((a > high) | (b > high)), gap = any((a != a) | (b != b));
    }
    for (int i = n == kTileSide ? kTile : 0; i < n; ++i) up = up || h[i] > high, gap = gap || h[i] != h[i];
    above[tile] |= up ? 1 : 0, gaps[tile] |= gap ? 1 : 0;
  }
}

// out = the sum of `count` rows, each `apart` behind the one before, over `wide` floats, a multiple of the lanes. Every
// point is summed afresh: with running sums the rounding would depend on where the tile begins.
DEBULK_INLINE void add_rows(const float* first, int count, long apart, int wide, float* out) {
  for (int i = 0; i < wide; i += lanes) {
    Floats sum = load(first + i);
    for (int k = 1; k < count; ++k) sum = sum + load(first + i + k * apart);
    store(out + i, sum);
  }
}

// out = a + b + c.
DEBULK_INLINE void add_three(const float* a, const float* b, const float* c, float* out) {
  for (int i = 0; i < kTileStride; i += lanes) store(out + i, load(a + i) + load(b + i) + load(c + i));
}

// Sums over the squares of n = 2 r + 1 and of 2 n + 1 points around each point of a tile, whose first point is `first` and
// whose rows are `stride` apart. The wider sums are two of the narrower ones and what lies between them, along the rows
// and then across them. Behind the points of a row all may hold anything.
void square_sums(const float* first, long stride, int r, const SumMemory& memory, float* fine, float* coarse) {
  const int n = 2 * r + 1, wide = sum_stride(r), rows = kTileSide + 2 * n;
  for (int j = 0; j < rows; ++j) {
    const float* row = first + (j - n) * stride;
    float* narrow = memory.narrow + j * wide;
    add_rows(row - n, n, 1, wide, narrow);
    add_three(narrow, row, narrow + n + 1, memory.broad + j * kTileStride);
  }
  for (int j = 0; j < kTileSide; ++j) add_rows(memory.narrow + (j + r + 1) * wide + r + 1, n, wide, kTileStride, fine + j * kTileStride);
  float* part = memory.narrow;  // no longer needed
  for (int j = 0; j <= rows - n; ++j) add_rows(memory.broad + j * kTileStride, n, kTileStride, kTileStride, part + j * kTileStride);
  for (int j = 0; j < kTileSide; ++j)
    add_three(part + j * kTileStride, memory.broad + (j + n) * kTileStride, part + (j + n + 1) * kTileStride, coarse + j * kTileStride);
}

// Turns sums of `count` heights into gaps. Returns whether all of a tile's are known.
bool to_gaps(float* __restrict sums, float count, float thickness) {
  int unknown = 0;
  for (int j = 0; j < kTileSide; ++j) {
    float* row = sums + j * kTileStride;
    for (int i = 0; i < kTileSide; ++i) unknown |= row[i] != row[i];
    for (int i = 0; i < kTileStride; ++i) row[i] = row[i] / count - thickness;
  }
  return unknown == 0;
}

// The same where each sum has its own count; gaps at points that are not known themselves are NaN.
void to_gaps(float* __restrict sums, const float* __restrict counts, const float* __restrict known, long stride, float thickness) {
  for (int j = 0; j < kTileSide; ++j, sums += kTileStride, counts += kTileStride, known += stride)
    for (int i = 0; i < kTileSide; ++i) sums[i] = known[i] > 0 ? sums[i] / counts[i] - thickness : std::numeric_limits<float>::quiet_NaN();
}

// Sets heights, 0 where they are not known or not `on`, and whether they are known, 1 or 0.
void copy_known(const float* __restrict heights, const std::uint8_t* __restrict on, int count, float* __restrict values,
                float* __restrict known) {
  for (int i = 0; i < count; ++i) {
    const bool good = (heights[i] == heights[i]) & (on[i] != 0);
    values[i] = good ? heights[i] : 0.0F, known[i] = good ? 1.0F : 0.0F;
  }
}
