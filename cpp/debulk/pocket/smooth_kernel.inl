// The loops of smooth.cpp: included there once for each Isa (see core/simd_dispatch.inl). Plain loops
// that the compiler makes wide.

// From one row's values (0 where unknown) and their number (1 or 0): sums over k = -half .. half of the value, of x² times it,
// and of the number, at each of `count` places. values[0] is `half` to the left of the first place.
void row_sums(const double* values, const int* known, const double* squares, int half, int count, double* __restrict s0,
              double* __restrict s2, int* __restrict number) {
  for (int i = 0; i < count; ++i) s0[i] = s2[i] = 0, number[i] = 0;
  for (int k = 0; k <= 2 * half; ++k) {
    const double w = squares[k];
    const double* from = values + k;
    const int* there = known + k;
    for (int i = 0; i < count; ++i) {
      s0[i] += from[i];
      s2[i] += w * from[i];
      number[i] += there[i];
    }
  }
}

// Adds a row's share to the fit's value at the centre.
void add_row(const double* s0, const double* s2, const int* number, double c0, double c2, int count, double* __restrict value,
             int* __restrict total) {
  for (int i = 0; i < count; ++i) {
    value[i] += c0 * s0[i] + c2 * s2[i];
    total[i] += number[i];
  }
}
