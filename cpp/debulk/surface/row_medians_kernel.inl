// The loop of row_medians.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// The upper medians of sixteen rows side by side, NaN where most of a row is missing; missing values are sorted to the end.
template <int Cells>
DEBULK_INLINE Floats row_median(const float* middle, const std::ptrdiff_t* at) {
  Floats v[Cells];
  Ints seen = {};
  for (int k = 0; k < Cells; ++k) {
    v[k] = load(middle + at[k]);
    const Ints known = v[k] == v[k];
    seen -= known;  // a mask is -1
    v[k] = choose(known, v[k], all(infinity));
  }
  for (int round = 0; round < Cells; ++round)
    for (int k = round % 2; k + 1 < Cells; k += 2) {
      const Floats low = lower(v[k], v[k + 1]), high = higher(v[k], v[k + 1]);
      v[k] = low, v[k + 1] = high;
    }
  Floats out = v[Cells / 2];
  for (int k = Cells / 2 - 1; k >= (Cells + 1) / 4; --k) out = choose(seen < 2 * k + 2, v[k], out);
  return choose(seen > Cells / 2, out, all(std::numeric_limits<float>::quiet_NaN()));
}

template <int Cells>
DEBULK_INLINE void highest(const float* row, const std::ptrdiff_t* at, int nx, float* out) {
  for (int i = 0; i < nx; i += lanes) {
    Floats best = all(std::numeric_limits<float>::quiet_NaN());
    for (int turn = 0; turn < kTurns; ++turn) {
      const Floats found = row_median<Cells>(row + i, at + turn * Cells);
      best = choose(found <= best, best, choose(found == found, found, best));
    }
    store(out + i, best);
  }
}

void run(int cells, const float* row, const std::ptrdiff_t* at, int nx, float* out) {
  cells == 5 ? highest<5>(row, at, nx, out) : highest<13>(row, at, nx, out);
}
