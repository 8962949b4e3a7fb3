#pragma once

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace debulk {

// Which instructions a wide loop uses. Sources with wide loops put them into a file that simd_dispatch.inl includes once for
// each of these, and choose at run time; all do the same operations in the same order, without fused multiply-add: the same
// bits on each. (target_clones would split wide vectors before it clones.)
enum class Isa { base, v3, v4 };

// The widest that this machine has.
Isa best_isa();

}  // namespace debulk

#define DEBULK_INLINE inline __attribute__((always_inline))
#define DEBULK_LAMBDA __attribute__((always_inline))
#define DEBULK_ON(isa, ...) ((isa) == Isa::v4 ? v4::__VA_ARGS__ : (isa) == Isa::v3 ? v3::__VA_ARGS__ : base::__VA_ARGS__)
