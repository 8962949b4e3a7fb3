// The sums of fit_sums.hpp, for as many of the rows or nodes at once as a register has doubles.

typedef double Doubles __attribute__((vector_size(register_bytes)));
typedef float FourFloats __attribute__((vector_size(16)));
typedef double FourDoubles __attribute__((vector_size(32)));
typedef int FourInts __attribute__((vector_size(16)));
constexpr int doubles = sizeof(Doubles) / sizeof(double);

DEBULK_INLINE Doubles load_doubles(const double* from) {
  Doubles v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
template <std::size_t kCount>
DEBULK_INLINE void store_doubles(const Doubles (&sums)[kCount], double* to) {
  for (std::size_t k = 0; k < kCount; ++k) std::memcpy(to + k * kTogether, &sums[k], sizeof sums[k]);
}
DEBULK_INLINE void store_four(FourFloats v, double* to) {
  const FourDoubles four = __builtin_convertvector(v, FourDoubles);
  std::memcpy(to, &four, sizeof four);
}

inline bool together(const float* const* rows, int count, double* columns, double* missing) {
  FourInts any = {};
  for (int first = 0; first < kTogether; first += 4)
    for (int column = 0; column < count; column += 4) {
      const int i = column + 4 <= count ? column : count - 4;
      FourFloats a, b, c, d;
      std::memcpy(&a, rows[first] + i, sizeof a), std::memcpy(&b, rows[first + 1] + i, sizeof b);
      std::memcpy(&c, rows[first + 2] + i, sizeof c), std::memcpy(&d, rows[first + 3] + i, sizeof d);
      const FourFloats ac_low = __builtin_shuffle(a, c, FourInts{0, 4, 1, 5}), ac_high = __builtin_shuffle(a, c, FourInts{2, 6, 3, 7});
      const FourFloats bd_low = __builtin_shuffle(b, d, FourInts{0, 4, 1, 5}), bd_high = __builtin_shuffle(b, d, FourInts{2, 6, 3, 7});
      const FourFloats turned[4] = {
          __builtin_shuffle(ac_low, bd_low, FourInts{0, 4, 1, 5}), __builtin_shuffle(ac_low, bd_low, FourInts{2, 6, 3, 7}),
          __builtin_shuffle(ac_high, bd_high, FourInts{0, 4, 1, 5}), __builtin_shuffle(ac_high, bd_high, FourInts{2, 6, 3, 7})};
#pragma GCC unroll 4
      for (int k = 0; k < 4; ++k) {
        const FourFloats zero = {}, one = {1, 1, 1, 1};
        const FourInts none = turned[k] != turned[k];
        any |= none;
        store_four(none ? zero : turned[k], columns + (i + k) * kTogether + first);
        store_four(none ? one : zero, missing + (i + k) * kTogether + first);
      }
    }
  return (any[0] | any[1] | any[2] | any[3]) != 0;
}

inline void along_rows(const double* columns, int reach, const double* weights, double* out) {
  for (int part = 0; part < kTogether; part += doubles) {
    const Doubles z = load_doubles(columns + part);
    Doubles sums[kSums] = {weights[0] * z, {}, {}, weights[0] * z * z};
    for (int d = 1; d <= reach; ++d) {
      const double* w = weights + 5 * d;
      const Doubles left = load_doubles(columns + part - d * kTogether), right = load_doubles(columns + part + d * kTogether);
      const Doubles sum = right + left;
      sums[0] += w[0] * sum, sums[1] += w[1] * (right - left), sums[2] += w[2] * sum;
      sums[3] += w[0] * (left * left + right * right);
    }
    store_doubles(sums, out + part);
  }
}

inline void along_missing(const double* missing, int reach, const double* weights, double* out) {
  for (int part = 0; part < kTogether; part += doubles) {
    Doubles sums[kWeights] = {weights[0] * load_doubles(missing + part)};
    for (int d = 1; d <= reach; ++d) {
      const double* w = weights + 5 * d;
      const Doubles left = load_doubles(missing + part - d * kTogether), right = load_doubles(missing + part + d * kTogether);
      const Doubles even = right + left, odd = right - left;
      sums[0] += w[0] * even, sums[1] += w[1] * odd, sums[2] += w[2] * even, sums[3] += w[3] * odd, sums[4] += w[4] * even;
    }
    store_doubles(sums, out + part);
  }
}

inline void over_rows(const double* rows, int count, const double* weights, double* out) {
  for (int part = 0; part < kTogether; part += doubles) {
    Doubles sums[kSquareSums] = {};
    for (int n = 0; n < count; ++n) {
      const double *w = weights + 5 * n, *row = rows + static_cast<long>(n) * static_cast<long>(kSums) * kTogether + part;
      const Doubles even = load_doubles(row), odd = load_doubles(row + kTogether), second = load_doubles(row + 2 * kTogether);
      sums[0] += w[0] * even, sums[1] += w[0] * odd, sums[2] += w[0] * second;
      sums[3] += w[1] * even, sums[4] += w[1] * odd, sums[5] += w[2] * even;
      sums[6] += w[0] * load_doubles(row + 3 * kTogether);
    }
    store_doubles(sums, out + part);
  }
}

inline void missing_rows(const double* rows, const int* row_of, int low, int count, const double* weights, double* out) {
  for (int part = 0; part < kTogether; part += doubles) {
    Doubles sums[kSquareWeights];
    for (std::size_t at = 0; at < kSquareWeights; ++at) sums[at] = load_doubles(out + at * kTogether + part);
    for (int n = 0; n < count; ++n) {
      const double *w = weights + 5 * (row_of[n] - low),
                   *row = rows + static_cast<long>(n) * static_cast<long>(kWeights) * kTogether + part;
      std::size_t at = 0;
      for (std::size_t a = 0; a < kWeights; ++a) {
        const Doubles sum = load_doubles(row + a * kTogether);
        for (std::size_t b = 0; a + b < kWeights; ++b, ++at) sums[at] -= w[b] * sum;
      }
    }
    store_doubles(sums, out + part);
  }
}
