#pragma once

#include <cstring>

// Sixteen floats at once. A function marked DEBULK_WIDE is compiled for several instruction sets and chosen at run time;
// what it calls is DEBULK_INLINE, so that it is compiled with it. All do the same operations in the same order, without fused
// multiply-add: the same bits on each. Sources that use it are compiled with -O3 -fno-math-errno -fno-trapping-math.
#define DEBULK_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#define DEBULK_INLINE inline __attribute__((always_inline))
#define DEBULK_LAMBDA __attribute__((always_inline))

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // inlined: no vector is passed between instruction sets

namespace debulk::wide {

constexpr int lanes = 16;
typedef float Floats __attribute__((vector_size(64)));
typedef int Ints __attribute__((vector_size(64)));  // a mask has all bits of a lane set or none
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
// The second where the first is NaN.
DEBULK_INLINE Floats lower(Floats a, Floats b) {
  return a < b ? a : b;
}
DEBULK_INLINE Floats higher(Floats a, Floats b) {
  return a > b ? a : b;
}
DEBULK_INLINE Floats absolute(Floats a) {
  return reinterpret_cast<Floats>(reinterpret_cast<Ints>(a) & 0x7fffffff);
}
DEBULK_INLINE bool any(Ints mask) {
  unsigned long long words[8], bits = 0;
  std::memcpy(words, &mask, sizeof mask);
  for (const unsigned long long word : words) bits |= word;
  return bits != 0;
}
// x, y and z of sixteen points.
DEBULK_INLINE void load_points(const float* xyz, float* x, float* y, float* z) {
  for (int k = 0; k < lanes; ++k) {
    x[k] = xyz[3 * k];
    y[k] = xyz[3 * k + 1];
    z[k] = xyz[3 * k + 2];
  }
}

}  // namespace debulk::wide

#pragma GCC diagnostic pop
