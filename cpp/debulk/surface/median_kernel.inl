// The loop of median.cpp: included there once for each Isa (see core/each_isa.inl).

DEBULK_INLINE void order(Floats& a, Floats& b) {
  const Floats low = lower(a, b), high = higher(a, b);
  a = low, b = high;
}
DEBULK_INLINE Floats middle(Floats a, Floats b, Floats c) {
  return higher(lower(a, b), lower(higher(a, b), c));
}

// Medians of whole windows whose columns are `step` apart, from column `i` (not before `step`) on, sixteen at once as far as
// they go, but not for more than `most` columns; returns the column behind. A value nearer than the tolerance to its median stays itself. `incomplete` gets the columns (in rising
// order) whose window misses a value, but not those that miss a value themselves.
template <int Step>
DEBULK_INLINE int medians(const float* above, const float* row, const float* below, int i, int nx, float tolerance, float* out,
                          int* incomplete, int& count) {
  const int end = nx - Step, last = std::min(end, i + most);
  for (; i + lanes <= last || (last == end && i < end && end >= lanes + Step); i += lanes) {
    i = std::min(i, end - lanes);  // the last sixteen again rather than a few one by one
    Floats low[3], mid[3], high[3], all_there = {};
    for (int c = 0; c < 3; ++c) {
      const int at = i + (c - 1) * Step;
      low[c] = load(above + at), mid[c] = load(row + at), high[c] = load(below + at);
      all_there += (low[c] - low[c]) + (mid[c] - mid[c]) + (high[c] - high[c]);
      order(low[c], mid[c]), order(mid[c], high[c]), order(low[c], mid[c]);
    }
    const Floats lowest_high = lower(lower(high[0], high[1]), high[2]), highest_low = higher(higher(low[0], low[1]), low[2]);
    const Floats centre = load(row + i), found = middle(highest_low, middle(mid[0], mid[1], mid[2]), lowest_high);
    const Ints there = all_there == all_there;
    store(out + i, there & (absolute(centre - found) > tolerance) ? found : centre);
    const Ints again = ~there & (centre == centre);
    for (unsigned left = bits(again); left != 0; left &= left - 1) incomplete[count++] = i + __builtin_ctz(left);
  }
  return i;
}

int run(int step, const float* above, const float* row, const float* below, int i, int nx, float tolerance, float* out,
        int* incomplete, int& count) {
  return step == 1 ? medians<1>(above, row, below, i, nx, tolerance, out, incomplete, count)
                   : medians<2>(above, row, below, i, nx, tolerance, out, incomplete, count);
}
