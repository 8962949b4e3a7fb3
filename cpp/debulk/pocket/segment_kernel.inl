// The loop of segment.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// Does one row: keeps the heights that are known and on the ply and sets others to NaN. Writes the runs where heights
// on the ply are unknown, and where heights are at least `cut`.
void run(const float* given, const std::uint8_t* on_ply, int nx, float cut, float* heights, RunWriter& unknown, RunWriter& high) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  int i = 0;
  for (; i + lanes <= nx; i += lanes) {
    const Floats v = load(given + i);
    Ints ply = {};
    ply = ~ply;
    if (on_ply) ply = load_ints(on_ply + i) != 0;
    const Ints known = (v - v == 0) & ply;
    const Floats h = choose(known, v, all(nan));
    store(heights + i, h);
    unknown.add(i, bits(ply & ~known));
    high.add(i, bits(h >= cut));
  }
  for (; i < nx; ++i) {
    const bool ply = !on_ply || on_ply[i] != 0, known = ply && given[i] - given[i] == 0;
    heights[i] = known ? given[i] : nan;
    unknown.add(i, ply && !known, 1);
    high.add(i, heights[i] >= cut, 1);
  }
  unknown.end(nx), high.end(nx);
}
