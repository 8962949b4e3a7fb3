// The loop of median.cpp: included there once for each Isa (see core/each_isa.inl).
DEBULK_INLINE void order(Floats& a, Floats& b) {
  const Floats low = lower(a, b), high = higher(a, b);
  a = low, b = high;
}
DEBULK_INLINE Floats middle(Floats a, Floats b, Floats c) {
  return higher(lower(a, b), lower(higher(a, b), c));
}

// Medians of whole windows, from column 1 on, sixteen at once as far as they go; returns the column behind. `incomplete`
// gets the columns (in rising order) whose window misses a value, but not those that miss a value themselves.
int run(const float* above, const float* row, const float* below, int nx, float* out, int* incomplete, int& count) {
  int i = 1;
  for (; i + lanes <= nx - 1; i += lanes) {
    Floats low[3], mid[3], high[3], all_there = {};
    for (int c = 0; c < 3; ++c) {
      low[c] = load(above + i - 1 + c), mid[c] = load(row + i - 1 + c), high[c] = load(below + i - 1 + c);
      all_there += (low[c] - low[c]) + (mid[c] - mid[c]) + (high[c] - high[c]);
      order(low[c], mid[c]), order(mid[c], high[c]), order(low[c], mid[c]);
    }
    const Floats lowest_high = lower(lower(high[0], high[1]), high[2]), highest_low = higher(higher(low[0], low[1]), low[2]);
    const Floats centre = load(row + i), found = middle(highest_low, middle(mid[0], mid[1], mid[2]), lowest_high);
    const Ints there = all_there == all_there;
    store(out + i, there ? found : centre);
    const Ints again = ~there & (centre == centre);
    if (!any(again)) continue;
    for (int k = 0; k < lanes; ++k)
      if (again[k]) incomplete[count++] = i + k;
  }
  return i;
}
