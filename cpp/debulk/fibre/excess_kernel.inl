// The loops of spans.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

DEBULK_INLINE double hypotenuse(double step, double rise) {
  return __builtin_sqrt(step * step + rise * rise);
}

// The excess of each step from point to point, by either mean.
inline void excess_of_steps(const PointGaps* p, int count, double step, double* __restrict by_fine, double* __restrict by_coarse) {
  for (int k = 0; k < count; ++k) {
    const double rise = static_cast<double>(p[k + 1].mold) - static_cast<double>(p[k].mold), along_mold = hypotenuse(step, rise);
    by_fine[k] = hypotenuse(step, rise + (static_cast<double>(p[k + 1].fine) - static_cast<double>(p[k].fine))) - along_mold;
    by_coarse[k] = hypotenuse(step, rise + (static_cast<double>(p[k + 1].coarse) - static_cast<double>(p[k].coarse))) - along_mold;
  }
}

DEBULK_INLINE double height(const PointGaps& p) {
  return static_cast<double>(p.coarse) + static_cast<double>(p.mold);
}

// The curvature of the ply at each point, over `wide` points to either side; `square` is the square of their distance.
inline void curvatures(const PointGaps* p, int count, int wide, double square, double* __restrict out) {
  for (int k = 0; k < count; ++k) out[k] = (height(p[k - wide]) - 2 * height(p[k]) + height(p[k + wide])) / square;
}

// What a gap says of each point: not known, off the mold, or flat on it.
inline void mark(const PointGaps* p, int count, double off, double flat, std::uint8_t* __restrict marks) {
  for (int k = 0; k < count; ++k) {
    const auto gap = static_cast<double>(p[k].fine);
    const int known = gap == gap ? 1 : 2, up = gap > off ? 4 : 0, low = __builtin_fabs(gap) < flat ? 8 : 0;
    marks[k] = static_cast<std::uint8_t>(known | up | low);
  }
}
