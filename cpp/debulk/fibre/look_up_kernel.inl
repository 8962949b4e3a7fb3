// The loop of two_scales.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

typedef float FloatPoint __attribute__((vector_size(16)));
typedef double Point __attribute__((vector_size(32)));  // finer gap, coarser gap, mold and nothing

DEBULK_INLINE Point point(const float* from) {
#if DEBULK_ISA >= 3
  return reinterpret_cast<Point>(_mm256_cvtps_pd(_mm_loadu_ps(from)));
#else
  FloatPoint p;
  std::memcpy(&p, from, sizeof p);
  return __builtin_convertvector(p, Point);
#endif
}

// The values of raised places are fetched while others are looked for, because most are not in the cache.
void look_up(const ScaleTables& t, const double* x, const double* y, int count, const GapsAt& out) {
  constexpr int at_once = 32;
  double column[at_once], row[at_once], u[at_once], v[at_once];
  int inside[at_once], tile_of[at_once], point_of[at_once];
  const float* corner[at_once];
  const double last_column = t.nx - 1, last_row = t.ny - 1;
  const int tiles_across = t.columns;
  for (int from = 0; from < count; from += at_once) {
    const int n = std::min(at_once, count - from);
    for (int k = 0; k < n; ++k) {
      column[k] = (x[from + k] - t.x) / t.spacing, row[k] = (y[from + k] - t.y) / t.spacing;
      inside[k] = (column[k] >= 0) & (row[k] >= 0) & (column[k] < last_column) & (row[k] < last_row);
      const int i = static_cast<int>(std::min(std::max(column[k], 0.0), last_column));
      const int j = static_cast<int>(std::min(std::max(row[k], 0.0), last_row));
      u[k] = column[k] - i, v[k] = row[k] - j;
      tile_of[k] = (j >> kTileBits) * tiles_across + (i >> kTileBits);
      point_of[k] = (j & (kTile - 1)) * kTileSide + (i & (kTile - 1));
    }
    for (int k = 0; k < n; ++k) {
      Place& place = out.place[from + k];
      place = Place::outside, corner[k] = nullptr;
      if (!inside[k]) continue;
      const std::int32_t tile = t.tiles[tile_of[k]];
      place = Place::flat;
      if (tile >= 0) {
        place = Place::raised;
        corner[k] = t.values + (static_cast<std::size_t>(tile) * kPoints + static_cast<std::size_t>(point_of[k])) * kEach;
        __builtin_prefetch(corner[k]), __builtin_prefetch(corner[k] + kTileSide * kEach);
      } else if (tile == kGaps) {
        const float h = t.heights[static_cast<std::size_t>(static_cast<int>(row[k] + 0.5)) * t.nx + static_cast<int>(column[k] + 0.5)];
        if (h != h) place = Place::unknown;
      }
    }
    for (int k = 0; k < n; ++k) {
      Point all = {kNan, kNan, kNan};
      if (const float* c = corner[k]) {
        const Point low = (1 - u[k]) * point(c) + u[k] * point(c + kEach);
        const Point high = (1 - u[k]) * point(c + kTileSide * kEach) + u[k] * point(c + (kTileSide + 1) * kEach);
        all = (1 - v[k]) * low + v[k] * high;
      }
      out.fine[from + k] = all[0], out.coarse[from + k] = all[1], out.mold[from + k] = all[2];
    }
  }
}
