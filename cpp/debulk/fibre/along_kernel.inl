// The loops of gaps_along.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// The points from number `first` on of a straight line.
void place(const StraightLine& line, int first, int count, double* __restrict x, double* __restrict y) {
  for (int k = 0; k < count; ++k) {
    const double along = (first + k) * line.step;
    x[k] = line.x + along * line.way_x, y[k] = line.y + along * line.way_y;
  }
}

// The tile at each place, row by row; kOutside beyond the grid.
void find_tiles(const TileGrid& grid, const double* __restrict x, const double* __restrict y, int count, std::int32_t* __restrict tile) {
  const TileGrid t = grid;
  for (int k = 0; k < count; ++k) {
    const double column = (x[k] - t.x) / t.spacing, row = (y[k] - t.y) / t.spacing;
    const int inside = (column >= 0) & (row >= 0) & (column < t.last_column) & (row < t.last_row);
    const int i = static_cast<int>(std::min(std::max(column, 0.0), t.last_column));
    const int j = static_cast<int>(std::min(std::max(row, 0.0), t.last_row));
    tile[k] = inside * ((j >> kTileBits) * t.columns + (i >> kTileBits) - kOutside) + kOutside;
  }
}

typedef float FourFloats __attribute__((vector_size(16)));
typedef long long TwoLongs __attribute__((vector_size(16)));
typedef double FourDoubles __attribute__((vector_size(32)));
typedef long long FourLongs __attribute__((vector_size(32)));

// The four corners of a cell: low left, low right, high left, high right.
DEBULK_INLINE FourDoubles corners(const float* cell) {
  long long low, high;  // put together in a register: a load of what two stores have just written would wait for both
  std::memcpy(&low, cell, sizeof low), std::memcpy(&high, cell + kTileStride, sizeof high);
  return __builtin_convertvector(reinterpret_cast<FourFloats>(TwoLongs{low, high}), FourDoubles);
}

// Reads places in one tile, whose first point is (i0, j0). `left`: a unit vector to the left of the line at each.
void read_tile(const TileGrid& grid, int i0, int j0, const TileValues& tile, const double* x, const double* y, const double* left_x,
               const double* left_y, int count, PointGaps* out) {
  constexpr int at_once = 64;
  const TileGrid t = grid;
  double u[at_once], v[at_once], dx[at_once], dy[at_once];
  int at[at_once];
  for (int from = 0; from < count; from += at_once, x += at_once, y += at_once, left_x += at_once, left_y += at_once, out += at_once) {
    const int n = std::min(at_once, count - from);
    for (int k = 0; k < n; ++k) {
      const double column = (x[k] - t.x) / t.spacing, row = (y[k] - t.y) / t.spacing;
      const int i = static_cast<int>(column), j = static_cast<int>(row);
      u[k] = column - i, v[k] = row - j, at[k] = (j - j0) * kTileStride + (i - i0);
      dx[k] = left_x[k] / t.spacing, dy[k] = left_y[k] / t.spacing;
    }
    const FourDoubles right = {-1, 1, -1, 1}, up = {-1, -1, 1, 1}, at_left = {1, 0, 1, 0}, below = {1, 1, 0, 0};
    for (int k = 0; k < n; ++k) {
      const FourDoubles along_x = at_left + right * u[k], along_y = below + up * v[k];
      const FourDoubles share = along_x * along_y, slope = right * dx[k] * along_y + up * dy[k] * along_x;
      const FourDoubles coarse = corners(tile.coarse + at[k]);
      const FourDoubles a = corners(tile.fine + at[k]) * share, b = coarse * share, c = corners(tile.mold + at[k]) * share,
                        d = coarse * slope;
      const FourDoubles ab = __builtin_shuffle(a, b, FourLongs{0, 4, 2, 6}) + __builtin_shuffle(a, b, FourLongs{1, 5, 3, 7});
      const FourDoubles cd = __builtin_shuffle(c, d, FourLongs{0, 4, 2, 6}) + __builtin_shuffle(c, d, FourLongs{1, 5, 3, 7});
      const FourDoubles sums = __builtin_shuffle(ab, cd, FourLongs{0, 1, 4, 5}) + __builtin_shuffle(ab, cd, FourLongs{2, 3, 6, 7});
      const FourFloats four = __builtin_convertvector(sums, FourFloats);
      std::memcpy(out + k, &four, sizeof four);
    }
  }
}
