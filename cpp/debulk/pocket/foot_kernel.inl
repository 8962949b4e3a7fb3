// The loop of foot_contours.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

// Does one row: copies the labels, and gives kNobody to a point without one whose height is at least `hill` before and
// after smoothing. Writes the runs of points that have a label then, or whose smoothed height is at least `level`.
void claim_row(const std::int32_t* given, const float* heights, const float* smooth, int nx, float hill, float level, std::int32_t* labels,
               RunWriter& open) {
  int i = 0;
  for (; i + lanes <= nx; i += lanes) {
    const Ints label = read<Ints>(given + i);
    const Floats smoothed = load(smooth + i);
    const Ints stands = (label == 0) & (load(heights + i) >= hill) & (smoothed >= hill);
    const Ints claimed = choose(stands, Ints{} + kNobody, label);
    write(labels + i, claimed);
    open.add(i, bits((claimed != 0) | (smoothed >= level)));
  }
  for (; i < nx; ++i) {
    labels[i] = given[i] == 0 && heights[i] >= hill && smooth[i] >= hill ? kNobody : given[i];
    open.add(i, labels[i] != 0 || smooth[i] >= level, 1);
  }
  open.end(nx);
}
