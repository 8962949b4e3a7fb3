// The loop of median.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

DEBULK_INLINE void order(Floats& a, Floats& b) {
  const Floats low = lower(a, b), high = higher(a, b);
  a = low, b = high;
}
DEBULK_INLINE Floats middle(Floats a, Floats b, Floats c) {
  return higher(lower(a, b), lower(higher(a, b), c));
}
// The median of three columns of three values.
DEBULK_INLINE Floats median_of(const Floats (&window)[3][3]) {
  Floats low[3], mid[3], high[3];
  for (int c = 0; c < 3; ++c) {
    low[c] = window[c][0], mid[c] = window[c][1], high[c] = window[c][2];
    order(low[c], mid[c]), order(mid[c], high[c]), order(low[c], mid[c]);
  }
  const Floats lowest_high = lower(lower(high[0], high[1]), high[2]), highest_low = higher(higher(low[0], low[1]), low[2]);
  return middle(highest_low, middle(mid[0], mid[1], mid[2]), lowest_high);
}

// Takes the medians of windows whose columns are `step` apart, sixteen at once, from column `i` (not before `step`) to
// the end of a row that is long enough. Returns the column after the last one done. A value nearer to its median than
// the tolerance stays.
//
// Missing values become infinite, with alternating sign, so that the middle stays where it is. If their number is odd,
// one infinity is left over. With all signs changed, the middle is then the other one of the two middle values, and
// the mean of both is the median.
template <int Step>
DEBULK_INLINE int medians(const float* above, const float* row, const float* below, int i, int nx, float tolerance, float* out) {
  const int end = nx - Step;
  for (; i < end && end >= lanes + Step; i += lanes) {
    i = std::min(i, end - lanes);  // the last sixteen again rather than a few one by one
    Floats window[3][3], sum = {};
    for (int c = 0; c < 3; ++c) {
      const int at = i + (c - 1) * Step;
      window[c][0] = load(above + at), window[c][1] = load(row + at), window[c][2] = load(below + at);
      for (const Floats& v : window[c]) sum += v - v;
    }
    const Floats centre = window[1][1];
    Floats found;
    if (every(sum == sum)) {
      found = median_of(window);
    } else {
      Floats other[3][3], sign = all(infinity);
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) {
          const Floats v = window[c][r];
          const Ints there = v == v;
          window[c][r] = choose(there, v, sign), other[c][r] = choose(there, v, -sign);
          sign = choose(there, sign, -sign);
        }
      found = (median_of(window) + median_of(other)) * 0.5f;
    }
    store(out + i, choose(absolute(centre - found) > tolerance, found, centre));
  }
  return i;
}

int run(int step, const float* above, const float* row, const float* below, int i, int nx, float tolerance, float* out) {
  return step == 1 ? medians<1>(above, row, below, i, nx, tolerance, out) : medians<2>(above, row, below, i, nx, tolerance, out);
}
