// The loop of hole_patch.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

typedef double Doubles __attribute__((vector_size(register_bytes)));
constexpr int doubles = sizeof(Doubles) / sizeof(double);

DEBULK_INLINE Doubles load(const double* from) {
  Doubles v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

// Computes L D Lᵀ and the forward substitution for the columns from `first` to before `end` of a band matrix with
// `count` columns; all columns before `first` must be done. band[j * stride + d] is A(j + d, j); it is zero beyond the
// width, and the stride is at least 8 more than the width.
void factor(double* band, int width, int stride, double* b, int count, int first, int end) {
  for (int j = first; j < end; ++j) {
    const double* from = band + static_cast<long>(j) * stride;
    const double inverse = 1 / from[0];
    const int last = std::min(width, count - 1 - j);
    for (int d = 1; d <= last; ++d) {
      const double share = from[d] * inverse;
      if (share == 0) continue;
      double* to = band + static_cast<long>(j + d) * stride;
      for (int e = d; e <= last; e += doubles) {
        const Doubles less = load(to + e - d) - share * load(from + e);
        std::memcpy(to + e - d, &less, sizeof less);
      }
      b[j + d] -= share * b[j];
    }
  }
}
