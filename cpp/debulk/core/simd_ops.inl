// Operations on sixteen floats at once. simd_dispatch.inl includes this file once per Isa.

constexpr int lanes = 16;
typedef float Floats __attribute__((vector_size(64)));
typedef int Ints __attribute__((vector_size(64)));  // in a mask all bits of a lane are set, or none
typedef signed char Bytes __attribute__((vector_size(16)));

DEBULK_INLINE Floats load(const float* from) {
  Floats v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
DEBULK_INLINE void store(float* to, Floats v) {
  std::memcpy(to, &v, sizeof v);
}
DEBULK_INLINE Floats all(float value) {
  return value - Floats{};
}
// Lane by lane, the lower or the higher of two values; b where either of them is NaN.
DEBULK_INLINE Floats lower(Floats a, Floats b) {
  return a < b ? a : b;
}
DEBULK_INLINE Floats higher(Floats a, Floats b) {
  return a > b ? a : b;
}
DEBULK_INLINE Floats absolute(Floats a) {
  return reinterpret_cast<Floats>(reinterpret_cast<Ints>(a) & 0x7fffffff);
}
DEBULK_INLINE Floats root(Floats a) {
  alignas(64) float s[lanes];
  store(s, a);
  for (int k = 0; k < lanes; ++k) s[k] = __builtin_sqrtf(s[k]);
  return load(s);
}
// One bit per lane of a mask.
DEBULK_INLINE unsigned bits(Ints mask) {
#if DEBULK_ISA == 4
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask));
#elif defined(__x86_64__)
  __m128 quarters[4];
  std::memcpy(quarters, &mask, sizeof mask);
  unsigned out = 0;
  for (int k = 0; k < 4; ++k) out |= static_cast<unsigned>(_mm_movemask_ps(quarters[k])) << (4 * k);
  return out;
#else
  unsigned out = 0;
  for (int k = 0; k < lanes; ++k) out |= static_cast<unsigned>(mask[k] & 1) << k;
  return out;
#endif
}
DEBULK_INLINE bool any(Ints mask) {
  return bits(mask) != 0;
}
DEBULK_INLINE bool every(Ints mask) {
  return bits(mask) == 0xffff;
}
// Writes the lanes of v that the mask selects one after the other to `to`, and returns their number. Whatever stands
// behind them, up to the sixteenth place, may be overwritten.
DEBULK_INLINE int pack(Ints v, unsigned mask, int* to) {
#if DEBULK_ISA == 4
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(mask), reinterpret_cast<__m512i>(v)));
  return __builtin_popcount(mask);
#else
  if (mask == 0) return 0;
  alignas(64) int lane[lanes];
  std::memcpy(lane, &v, sizeof lane);
  int count = 0;
  for (; mask != 0; mask &= mask - 1) to[count++] = lane[__builtin_ctz(mask)];
  return count;
#endif
}
// The values from[index].
DEBULK_INLINE Floats gather(const float* from, Ints index) {
  alignas(64) int at[lanes];
  alignas(64) float values[lanes];
  std::memcpy(at, &index, sizeof at);
  for (int k = 0; k < lanes; ++k) values[k] = from[at[k]];
  return load(values);
}
// The same for indices into the first 16 N floats of `from`, all of which must exist.
template <int N>
DEBULK_INLINE Floats pick(const float* from, Ints index) {
#if DEBULK_ISA == 4
  static_assert(N == 1 || N == 3);
  if constexpr (N == 1) return __builtin_shuffle(load(from), index);
  const Floats first = __builtin_shuffle(load(from), load(from + 16), index);
  return index < 32 ? first : __builtin_shuffle(load(from + 32), index);
#else
  return gather(from, index);
#endif
}

template <int N>
DEBULK_INLINE Floats swapped(Floats v) {
  const Ints partner = {0 ^ N, 1 ^ N, 2 ^ N,  3 ^ N,  4 ^ N,  5 ^ N,  6 ^ N,  7 ^ N,
                        8 ^ N, 9 ^ N, 10 ^ N, 11 ^ N, 12 ^ N, 13 ^ N, 14 ^ N, 15 ^ N};
  return __builtin_shuffle(v, partner);
}
DEBULK_INLINE float lowest(Floats v) {
  v = lower(v, swapped<8>(v)), v = lower(v, swapped<4>(v)), v = lower(v, swapped<2>(v));
  return lower(v, swapped<1>(v))[0];
}
DEBULK_INLINE float highest(Floats v) {
  v = higher(v, swapped<8>(v)), v = higher(v, swapped<4>(v)), v = higher(v, swapped<2>(v));
  return higher(v, swapped<1>(v))[0];
}
DEBULK_INLINE float total(Floats v) {
  v = v + swapped<8>(v), v = v + swapped<4>(v), v = v + swapped<2>(v);
  return (v + swapped<1>(v))[0];
}

// Reads x, y and z of sixteen consecutive points.
#if DEBULK_ISA == 4
DEBULK_INLINE void load_points(const float* xyz, Floats& x, Floats& y, Floats& z) {
  const Floats a = load(xyz), b = load(xyz + 16), c = load(xyz + 32);
  x = __builtin_shuffle(__builtin_shuffle(a, b, Ints{0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0}), c,
                        Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29});
  y = __builtin_shuffle(__builtin_shuffle(a, b, Ints{1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0}), c,
                        Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30});
  z = __builtin_shuffle(__builtin_shuffle(a, b, Ints{2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0}), c,
                        Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31});
}
#else
DEBULK_INLINE void load_points(const float* xyz, Floats& x, Floats& y, Floats& z) {
  alignas(64) float s[3][lanes];
  for (int k = 0; k < lanes; ++k) s[0][k] = xyz[3 * k], s[1][k] = xyz[3 * k + 1], s[2][k] = xyz[3 * k + 2];
  x = load(s[0]), y = load(s[1]), z = load(s[2]);
}
#endif
