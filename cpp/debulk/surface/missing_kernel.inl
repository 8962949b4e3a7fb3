// The loop of fill_holes.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// Writes the runs of a row where there is no value, and marks with 1 where there is one.
void run(const float* row, int nx, std::uint8_t* measured, RunWriter& missing) {
  int i = 0;
  for (; i + lanes <= nx; i += lanes) {
    const Floats v = load(row + i);
    const Ints there = v == v;
    store_bytes(measured + i, there & 1);
    missing.add(i, ~bits(there) & 0xffff);
  }
  for (; i < nx; ++i) {
    measured[i] = row[i] == row[i];
    missing.add(i, measured[i] ? 0 : 1, 1);
  }
  missing.end(nx);
}
