// The loop of cloud_view.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// Computes the box round the points that were seen, and returns their number.
long run(const float* xyz, long count, float* low, float* high) {
  Floats least[3] = {all(infinity), all(infinity), all(infinity)}, most[3] = {all(-infinity), all(-infinity), all(-infinity)};
  long seen = 0;
  const auto take = [&](const float* from) DEBULK_LAMBDA {
    Floats p[3] = {};
    load_points(from, p[0], p[1], p[2]);
    const Floats sum = p[0] + p[1] + p[2];
    const Ints there = sum - sum == 0;
    for (int a = 0; a < 3; ++a) {
      least[a] = lower(choose(there, p[a], all(infinity)), least[a]);
      most[a] = higher(choose(there, p[a], all(-infinity)), most[a]);
    }
    seen += __builtin_popcount(bits(there));
  };
  const long whole = count - count % lanes;
  for (long k = 0; k < whole; k += lanes) take(xyz + 3 * k);
  if (whole < count) {
    float last[3 * lanes];
    std::fill(last, last + 3 * lanes, infinity);  // not seen
    std::copy(xyz + 3 * whole, xyz + 3 * count, last);
    take(last);
  }
  for (int a = 0; a < 3; ++a) low[a] = lowest(least[a]), high[a] = highest(most[a]);
  return seen;
}
