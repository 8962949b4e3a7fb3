// Operations on sixteen floats at once. simd_dispatch.inl includes this file once per Isa. Where v4 has one vector of
// sixteen lanes, the others have pairs of the registers' own vectors (see simd_pair.inl).

constexpr int lanes = 16;
constexpr int register_bytes = DEBULK_ISA == 4 ? 64 : DEBULK_ISA == 3 ? 32 : 16;
typedef signed char Bytes __attribute__((vector_size(16)));

#if DEBULK_ISA == 4
typedef float Floats __attribute__((vector_size(64)));
typedef int Ints __attribute__((vector_size(64)));  // in a mask all bits of a lane are set, or none

// Lane by lane, a where the mask is set and b elsewhere.
DEBULK_INLINE Floats choose(Ints mask, Floats a, Floats b) {
  return mask ? a : b;
}
DEBULK_INLINE Ints choose(Ints mask, Ints a, Ints b) {
  return mask ? a : b;
}
DEBULK_INLINE Floats root(Floats a) {
  alignas(64) float s[lanes];  // GCC 12 warns of the intrinsic's undefined operand
  std::memcpy(s, &a, sizeof s);
  for (int k = 0; k < lanes; ++k) s[k] = __builtin_sqrtf(s[k]);
  std::memcpy(&a, s, sizeof a);
  return a;
}
// The lanes in an order in which each has changed places with the one N away.
template <int N>
DEBULK_INLINE Floats swapped(Floats v) {
  const Ints partner = {0 ^ N, 1 ^ N, 2 ^ N,  3 ^ N,  4 ^ N,  5 ^ N,  6 ^ N,  7 ^ N,
                        8 ^ N, 9 ^ N, 10 ^ N, 11 ^ N, 12 ^ N, 13 ^ N, 14 ^ N, 15 ^ N};
  return __builtin_shuffle(v, partner);
}
// Reads x, y and z of sixteen consecutive points.
DEBULK_INLINE void load_points(const float* xyz, Floats& x, Floats& y, Floats& z) {
  Floats a, b, c;
  std::memcpy(&a, xyz, sizeof a), std::memcpy(&b, xyz + 16, sizeof b), std::memcpy(&c, xyz + 32, sizeof c);
  x = __builtin_shuffle(__builtin_shuffle(a, b, Ints{0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0}), c,
                        Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29});
  y = __builtin_shuffle(__builtin_shuffle(a, b, Ints{1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0}), c,
                        Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30});
  z = __builtin_shuffle(__builtin_shuffle(a, b, Ints{2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0}), c,
                        Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31});
}
#else
typedef float RegisterFloats __attribute__((vector_size(register_bytes)));
typedef int RegisterInts __attribute__((vector_size(register_bytes)));

DEBULK_INLINE RegisterFloats choose(RegisterInts mask, RegisterFloats a, RegisterFloats b) {
  return mask ? a : b;
}
DEBULK_INLINE RegisterInts choose(RegisterInts mask, RegisterInts a, RegisterInts b) {
  return mask ? a : b;
}
template <int N>
DEBULK_INLINE RegisterFloats swapped(RegisterFloats v) {
#if DEBULK_ISA == 3
  const RegisterInts partner = {0 ^ N, 1 ^ N, 2 ^ N, 3 ^ N, 4 ^ N, 5 ^ N, 6 ^ N, 7 ^ N};
#else
  const RegisterInts partner = {0 ^ N, 1 ^ N, 2 ^ N, 3 ^ N};
#endif
  return __builtin_shuffle(v, partner);
}
#if DEBULK_ISA == 3
DEBULK_INLINE RegisterFloats root(RegisterFloats a) {
  return reinterpret_cast<RegisterFloats>(_mm256_sqrt_ps(reinterpret_cast<__m256>(a)));
}
#elif defined(__x86_64__)
DEBULK_INLINE RegisterFloats root(RegisterFloats a) {
  return reinterpret_cast<RegisterFloats>(_mm_sqrt_ps(reinterpret_cast<__m128>(a)));
}
#else
DEBULK_INLINE RegisterFloats root(RegisterFloats a) {
  for (int k = 0; k < 4; ++k) a[k] = __builtin_sqrtf(a[k]);
  return a;
}
#endif
// Reads x, y and z of as many consecutive points as a register has lanes.
DEBULK_INLINE void load_points(const float* xyz, RegisterFloats& x, RegisterFloats& y, RegisterFloats& z) {
  // Each 16 bytes of a register come from four points: x y z x, y z x y and z x y z.
  RegisterFloats a, b, c;
  for (int part = 0; part < register_bytes / 16; ++part) {
    char *to_a = reinterpret_cast<char*>(&a), *to_b = reinterpret_cast<char*>(&b), *to_c = reinterpret_cast<char*>(&c);
    std::memcpy(to_a + 16 * part, xyz + 12 * part, 16);
    std::memcpy(to_b + 16 * part, xyz + 12 * part + 4, 16);
    std::memcpy(to_c + 16 * part, xyz + 12 * part + 8, 16);
  }
#if DEBULK_ISA == 3
  constexpr int n = 8;
  const RegisterInts middle = {2, 3, n + 1, n + 2, 6, 7, n + 5, n + 6}, ends = {1, 2, n, n + 1, 5, 6, n + 4, n + 5};
  const RegisterInts of_x = {0, 3, n, n + 2, 4, 7, n + 4, n + 6}, of_y = {0, 2, n + 1, n + 3, 4, 6, n + 5, n + 7};
  const RegisterInts of_z = {1, 3, n, n + 3, 5, 7, n + 4, n + 7};
#else
  constexpr int n = 4;
  const RegisterInts middle = {2, 3, n + 1, n + 2}, ends = {1, 2, n, n + 1};
  const RegisterInts of_x = {0, 3, n, n + 2}, of_y = {0, 2, n + 1, n + 3}, of_z = {1, 3, n, n + 3};
#endif
  const RegisterFloats xy = __builtin_shuffle(b, c, middle), yz = __builtin_shuffle(a, b, ends);
  x = __builtin_shuffle(a, xy, of_x), y = __builtin_shuffle(yz, xy, of_y), z = __builtin_shuffle(yz, c, of_z);
}

#include "debulk/core/simd_pair.inl"

#if DEBULK_ISA == 3
using Floats = Pair<RegisterFloats, float>;
using Ints = Pair<RegisterInts, int>;
#else
using Floats = Pair<Pair<RegisterFloats, float>, float>;
using Ints = Pair<Pair<RegisterInts, int>, int>;
#endif
#endif

static_assert(sizeof(Floats) == lanes * sizeof(float) && sizeof(Ints) == lanes * sizeof(int));

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
// 0 to 15.
DEBULK_INLINE Ints counting() {
  static constexpr int numbers[lanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  Ints v;
  std::memcpy(&v, numbers, sizeof v);
  return v;
}
// The same bits as another type.
template <class To, class From>
DEBULK_INLINE To as(const From& from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &from, sizeof to);
  return to;
}
// The same values as another type, of sixteen lanes, too; fractions are cut off.
template <class To, class From>
DEBULK_INLINE To converted(const From& from) {
#if DEBULK_ISA == 4
  return __builtin_convertvector(from, To);
#else
  constexpr int steps = lanes * 4 / register_bytes;
  using Lane = std::decay_t<decltype(std::declval<const From&>()[0])>;
  using ToLane = std::decay_t<decltype(std::declval<const To&>()[0])>;
  typedef Lane Few __attribute__((vector_size(register_bytes / 4 * sizeof(Lane))));
  typedef ToLane FewTo __attribute__((vector_size(register_bytes / 4 * sizeof(ToLane))));
  Few parts[steps];
  FewTo out[steps];
  static_assert(sizeof parts == sizeof from && sizeof out == sizeof(To));
  std::memcpy(parts, &from, sizeof parts);
  for (int k = 0; k < steps; ++k) out[k] = __builtin_convertvector(parts[k], FewTo);
  To to;
  std::memcpy(&to, out, sizeof to);
  return to;
#endif
}
// Lane by lane, the lower or the higher of two values; b where either of them is NaN.
DEBULK_INLINE Floats lower(Floats a, Floats b) {
  return choose(a < b, a, b);
}
DEBULK_INLINE Floats higher(Floats a, Floats b) {
  return choose(a > b, a, b);
}
DEBULK_INLINE Floats absolute(Floats a) {
  return as<Floats>(as<Ints>(a) & 0x7fffffff);
}
// One bit per lane of a mask.
DEBULK_INLINE unsigned bits(Ints mask) {
#if DEBULK_ISA == 4
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask));
#elif DEBULK_ISA == 3
  const auto low = static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask.low)));
  return low | static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask.high))) << 8;
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
  return choose(index < 32, first, __builtin_shuffle(load(from + 32), index));
#else
  return gather(from, index);
#endif
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
