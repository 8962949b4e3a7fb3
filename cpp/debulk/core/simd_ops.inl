// Operations on sixteen floats at once. simd_dispatch.inl includes this file once per Isa. Where v4 has one vector of
// sixteen lanes, the others have pairs of the registers' own vectors (see simd_pair.inl).

constexpr int lanes = 16;
constexpr int register_bytes = DEBULK_ISA == 4 ? 64 : DEBULK_ISA == 3 ? 32 : 16;

// Whether a vector is made of two halves (see simd_pair.inl).
template <class Vector>
constexpr bool is_pair = false;

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
// The values from[index].
DEBULK_INLINE Floats gather(const float* from, Ints index) {
  alignas(64) int at[lanes];
  alignas(64) float values[lanes];
  std::memcpy(at, &index, sizeof at);
  for (int k = 0; k < lanes; ++k) values[k] = from[at[k]];
  std::memcpy(&index, values, sizeof values);
  return reinterpret_cast<Floats>(index);
}
// GCC 12 converts between vectors of bytes and of integers lane by lane, hence the intrinsics, here and below; it warns of
// the undefined operand of those without a mask.
DEBULK_INLINE void load_ints(const std::uint8_t* from, Ints& v) {
  v = reinterpret_cast<Ints>(_mm512_maskz_cvtepu8_epi32(0xffff, _mm_loadu_si128(reinterpret_cast<const __m128i*>(from))));
}
DEBULK_INLINE void load_ints(const std::uint16_t* from, Ints& v) {
  v = reinterpret_cast<Ints>(_mm512_maskz_cvtepu16_epi32(0xffff, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from))));
}
// Writes the lowest eight bits of each number.
DEBULK_INLINE void store_bytes(std::uint8_t* to, Ints v) {
  _mm_storeu_si128(reinterpret_cast<__m128i*>(to), _mm512_maskz_cvtepi32_epi8(0xffff, reinterpret_cast<__m512i>(v)));
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
DEBULK_INLINE RegisterFloats gather(const float* from, RegisterInts i) {
#if DEBULK_ISA == 3
  return RegisterFloats{from[i[0]], from[i[1]], from[i[2]], from[i[3]], from[i[4]], from[i[5]], from[i[6]], from[i[7]]};
#else
  return RegisterFloats{from[i[0]], from[i[1]], from[i[2]], from[i[3]]};
#endif
}
// Reads x, y and z of as many consecutive points as a register has lanes.
DEBULK_INLINE void load_points(const float* xyz, RegisterFloats& x, RegisterFloats& y, RegisterFloats& z) {
  // Each 16 bytes of a register come from four points: x y z x, y z x y and z x y z.
  const auto quarters = [](const float* at) DEBULK_LAMBDA {
#if DEBULK_ISA == 3
    return reinterpret_cast<RegisterFloats>(_mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(at)), _mm_loadu_ps(at + 12), 1));
#else
    RegisterFloats four;
    std::memcpy(&four, at, sizeof four);
    return four;
#endif
  };
  const RegisterFloats a = quarters(xyz), b = quarters(xyz + 4), c = quarters(xyz + 8);
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

#if DEBULK_ISA == 3
DEBULK_INLINE void load_ints(const std::uint8_t* from, RegisterInts& v) {
  v = reinterpret_cast<RegisterInts>(_mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from))));
}
DEBULK_INLINE void load_ints(const std::uint16_t* from, RegisterInts& v) {
  v = reinterpret_cast<RegisterInts>(_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from))));
}
DEBULK_INLINE void store_bytes(std::uint8_t* to, RegisterInts v) {
  const __m256i all = reinterpret_cast<__m256i>(v & 0xff);
  const __m128i shorts = _mm_packus_epi32(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(to), _mm_packus_epi16(shorts, shorts));
}
#else
template <class T>
DEBULK_INLINE void load_ints(const T* from, RegisterInts& v) {
  v = RegisterInts{from[0], from[1], from[2], from[3]};
}
DEBULK_INLINE void store_bytes(std::uint8_t* to, RegisterInts v) {
  for (int k = 0; k < 4; ++k) to[k] = static_cast<std::uint8_t>(v[k]);
}
#endif

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

// Vectors are read and written register by register. GCC copies a pair as a whole in pieces of 16 bytes, and a register
// that is then read from two such pieces waits until both have reached the cache.
template <class Vector>
DEBULK_INLINE Vector read(const void* from) {
  if constexpr (is_pair<Vector>) {
    using Half = decltype(Vector::low);
    return {read<Half>(from), read<Half>(static_cast<const char*>(from) + sizeof(Half))};
  } else {
    Vector v;
    std::memcpy(&v, from, sizeof v);
    return v;
  }
}
template <class Vector>
DEBULK_INLINE void write(void* to, const Vector& v) {
  if constexpr (is_pair<Vector>)
    write(to, v.low), write(static_cast<char*>(to) + sizeof v.low, v.high);
  else
    std::memcpy(to, &v, sizeof v);
}
DEBULK_INLINE Floats load(const float* from) {
  return read<Floats>(from);
}
DEBULK_INLINE void store(float* to, Floats v) {
  write(to, v);
}
template <class T>
DEBULK_INLINE Ints load_ints(const T* from) {
  Ints v;
  load_ints(from, v);
  return v;
}
DEBULK_INLINE Floats all(float value) {
  return value - Floats{};
}
// 0 to 15.
DEBULK_INLINE Ints counting() {
  static constexpr int numbers[lanes] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return read<Ints>(numbers);
}
// The same bits as another type.
template <class To, class From>
DEBULK_INLINE To as(const From& from) {
  static_assert(sizeof(To) == sizeof(From));
  if constexpr (is_pair<To>)
    return {as<decltype(To::low)>(from.low), as<decltype(To::high)>(from.high)};
  else
    return reinterpret_cast<To>(from);
}
// The same values as floats or as integers; fractions are cut off.
template <class To, class From>
DEBULK_INLINE To converted(const From& from) {
  if constexpr (is_pair<To>)
    return {converted<decltype(To::low)>(from.low), converted<decltype(To::high)>(from.high)};
  else
    return __builtin_convertvector(from, To);
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
  const auto of = [](RegisterInts quarter)
                      DEBULK_LAMBDA { return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(quarter))); };
  return of(mask.low.low) | of(mask.low.high) << 4 | of(mask.high.low) << 8 | of(mask.high.high) << 12;
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
  write(lane, v);
  int count = 0;
  for (; mask != 0; mask &= mask - 1) to[count++] = lane[__builtin_ctz(mask)];
  return count;
#endif
}
#if DEBULK_ISA == 3
// Of the first 16 N floats of wherever it is applied to, those at eight indices. Indices that follow their first lane, as
// on a surface, lie in a window of sixteen and are picked from two registers; else they are gathered.
template <int N>
struct Eight {
  RegisterInts index, within;
  int window;
  bool narrow;
  DEBULK_INLINE explicit Eight(RegisterInts at) : index(at) {
    constexpr int before = 4, last = 16 * (N - 1);
    const int first = at[0] - before;
    window = first < 0 ? 0 : first < last ? first : last;
    within = at - window;
    narrow = _mm256_testz_si256(reinterpret_cast<__m256i>(within), _mm256_set1_epi32(~15)) != 0;
  }
  DEBULK_INLINE RegisterFloats operator()(const float* from) const {
    if (!narrow) return gather(from, index);
    const auto which = reinterpret_cast<__m256i>(within);  // permutations heed its lowest three bits alone
    const __m256 low = _mm256_permutevar8x32_ps(_mm256_loadu_ps(from + window), which);
    const __m256 high = _mm256_permutevar8x32_ps(_mm256_loadu_ps(from + window + 8), which);
    return reinterpret_cast<RegisterFloats>(_mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32(which, 28))));
  }
};
#endif

// gather() for indices into the first 16 N floats of wherever it is applied to, all of which must exist. What depends on the
// indices alone is done once.
template <int N>
struct Near {
  static_assert(N >= 1 && N <= 3);
#if DEBULK_ISA == 4
  Ints index;
  DEBULK_INLINE explicit Near(Ints at) : index(at) {}
  DEBULK_INLINE Floats operator()(const float* from) const {
    if constexpr (N == 1) return __builtin_shuffle(load(from), index);
    const Floats first = __builtin_shuffle(load(from), load(from + 16), index);
    if constexpr (N == 2) return first;
    return choose(index < 32, first, __builtin_shuffle(load(from + 32), index));
  }
#elif DEBULK_ISA == 3
  Eight<N> low, high;
  DEBULK_INLINE explicit Near(Ints at) : low(at.low), high(at.high) {}
  DEBULK_INLINE Floats operator()(const float* from) const { return {low(from), high(from)}; }
#else
  Ints index;
  DEBULK_INLINE explicit Near(Ints at) : index(at) {}
  DEBULK_INLINE Floats operator()(const float* from) const { return gather(from, index); }
#endif
};
template <int N>
DEBULK_INLINE Floats pick(const float* from, Ints index) {
  return Near<N>(index)(from);
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
