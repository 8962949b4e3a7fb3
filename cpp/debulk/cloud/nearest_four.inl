// The kernels of window_pass.cpp and open_search.cpp include this file, once per Isa.

template <class Vector>
DEBULK_INLINE void order(Vector& a, Vector& b) {
  const Vector low = choose(a < b, a, b), high = choose(a > b, a, b);
  a = low, b = high;
}

// Keeps the four smallest squared distances so far in each lane, ascending, and so the four smallest of all, without a
// branch. A search over few points needs no more than half of the lanes.
template <class Vector>
struct NearestIn {
  Vector least[4];
  float limit = infinity;  // not below the fourth smallest of all

  DEBULK_INLINE NearestIn() {
    for (Vector& kept : least) kept = infinity - Vector{};
  }
  DEBULK_INLINE void add(Vector d) {
    for (Vector& kept : least) order(kept, d);
  }
  // Lowers the limit to the largest of the minima of four disjoint sets of lanes: at least four distances are not
  // above it.
  DEBULK_INLINE void tighten() {
    Vector m = least[0];
    m = lower(m, swapped<8>(m)), m = lower(m, swapped<4>(m));
    m = higher(m, swapped<2>(m)), m = higher(m, swapped<1>(m));
    limit = m[0] < limit ? m[0] : limit;
  }
  // Of two ascending rows of four, the smaller of first and last, of second and third and so on are the four smallest
  // of all. They form a bitonic row, which is then sorted.
  template <int N>
  DEBULK_INLINE void merge() {
    const Vector other[4] = {swapped<N>(least[3]), swapped<N>(least[2]), swapped<N>(least[1]), swapped<N>(least[0])};
    for (int k = 0; k < 4; ++k) least[k] = choose(least[k] < other[k], least[k], other[k]);
    order(least[0], least[2]), order(least[1], least[3]), order(least[0], least[1]), order(least[2], least[3]);
  }
  // Ends the search. Returns the fourth smallest of all, infinite if there are fewer than four.
  DEBULK_INLINE float fourth() {
    if constexpr (sizeof(Vector) == sizeof(Floats)) merge<8>();
    merge<4>(), merge<2>(), merge<1>();
    return least[3][0];
  }
  // Mean distance of the four nearest, after fourth(). Those beyond a limit count as if they were there.
  DEBULK_INLINE float mean(float within) const {
    double sum = 0;
    for (const Vector& kept : least) sum += std::sqrt(static_cast<double>(std::min(kept[0], within)));
    return static_cast<float>(sum / 4);
  }
};
using Nearest = NearestIn<Floats>;
