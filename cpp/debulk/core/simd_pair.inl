// Sixteen values at once where the registers are narrower: two halves, each a vector of a register's size or, once more,
// two halves. (GCC splits the arithmetic of a vector that is wider than a register, but it compares and chooses between
// such vectors lane by lane: with them the pass over the cloud took five times as long on AVX2.)
// simd_ops.inl includes this file.

template <class Half, class Lane>
struct Pair {
  Half low, high;

  typedef Lane Alias __attribute__((may_alias));
  DEBULK_INLINE Alias& operator[](int lane) { return reinterpret_cast<Alias*>(this)[lane]; }
  DEBULK_INLINE Lane operator[](int lane) const { return reinterpret_cast<const Alias*>(this)[lane]; }

  using Mask = Pair<decltype(std::declval<Half>() < std::declval<Half>()), int>;

#define DEBULK_LANEWISE(Result, op)                                                                              \
  DEBULK_INLINE friend Result operator op(Pair a, Pair b) { return {a.low op b.low, a.high op b.high}; }         \
  DEBULK_INLINE friend Result operator op(Pair a, Lane b) { return {a.low op b, a.high op b}; }                  \
  DEBULK_INLINE friend Result operator op(Lane a, Pair b) { return {a op b.low, a op b.high}; }
  DEBULK_LANEWISE(Pair, +)
  DEBULK_LANEWISE(Pair, -)
  DEBULK_LANEWISE(Pair, *)
  DEBULK_LANEWISE(Pair, /)
  DEBULK_LANEWISE(Pair, &)
  DEBULK_LANEWISE(Pair, |)
  DEBULK_LANEWISE(Mask, <)
  DEBULK_LANEWISE(Mask, <=)
  DEBULK_LANEWISE(Mask, >)
  DEBULK_LANEWISE(Mask, >=)
  DEBULK_LANEWISE(Mask, ==)
  DEBULK_LANEWISE(Mask, !=)
#undef DEBULK_LANEWISE
  DEBULK_INLINE friend Pair operator-(Pair a) { return {-a.low, -a.high}; }
  DEBULK_INLINE friend Pair operator~(Pair a) { return {~a.low, ~a.high}; }
  DEBULK_INLINE Pair& operator+=(Pair b) { return *this = *this + b; }
  DEBULK_INLINE Pair& operator-=(Pair b) { return *this = *this - b; }
  DEBULK_INLINE Pair& operator-=(Lane b) { return *this = *this - b; }
  DEBULK_INLINE Pair& operator&=(Pair b) { return *this = *this & b; }
};

template <class Half, class Lane>
constexpr bool is_pair<Pair<Half, Lane>> = true;

template <class Half, class Lane>
DEBULK_INLINE Pair<Half, Lane> choose(typename Pair<Half, Lane>::Mask mask, Pair<Half, Lane> a, Pair<Half, Lane> b) {
  return {choose(mask.low, a.low, b.low), choose(mask.high, a.high, b.high)};
}
template <class Half>
DEBULK_INLINE Pair<Half, float> root(Pair<Half, float> a) {
  return {root(a.low), root(a.high)};
}
template <int N, class Half, class Lane>
DEBULK_INLINE Pair<Half, Lane> swapped(Pair<Half, Lane> v) {
  if constexpr (N * sizeof(Lane) == sizeof(Half))
    return {v.high, v.low};
  else
    return {swapped<N>(v.low), swapped<N>(v.high)};
}
template <class Half>
DEBULK_INLINE void load_points(const float* xyz, Pair<Half, float>& x, Pair<Half, float>& y, Pair<Half, float>& z) {
  load_points(xyz, x.low, y.low, z.low);
  load_points(xyz + 3 * sizeof(Half) / sizeof(float), x.high, y.high, z.high);
}
template <class Half>
DEBULK_INLINE auto gather(const float* from, Pair<Half, int> index) {
  return Pair<decltype(gather(from, index.low)), float>{gather(from, index.low), gather(from, index.high)};
}
template <class T, class Half>
DEBULK_INLINE void load_ints(const T* from, Pair<Half, int>& v) {
  load_ints(from, v.low), load_ints(from + sizeof(Half) / sizeof(int), v.high);
}
template <class Half>
DEBULK_INLINE void store_bytes(std::uint8_t* to, Pair<Half, int> v) {
  store_bytes(to, v.low), store_bytes(to + sizeof(Half) / sizeof(int), v.high);
}
