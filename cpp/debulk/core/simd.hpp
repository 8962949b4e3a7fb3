#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace debulk {

// The instruction set that a wide (vectorised) loop uses. A source puts its wide loops into a separate file, which
// simd_dispatch.inl includes once per instruction set, and chooses between the versions at run time. All versions do
// the same operations in the same order, without fused multiply-add, and so give the same bits. (GCC's attribute
// target_clones is not used because it splits wide vectors before it clones the function.)
enum class Isa { base, v3, v4 };

// The widest instruction set that this machine supports.
Isa best_isa();

}  // namespace debulk

// What every loop calls stands in the loop itself. Under a sanitizer, whose checks would stand there again with each call, it
// is called: the same checks, and files that compile in half to a quarter of the time.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DEBULK_INLINE inline
#define DEBULK_LAMBDA
#else
#define DEBULK_INLINE inline __attribute__((always_inline))
#define DEBULK_LAMBDA __attribute__((always_inline))
#endif
#define DEBULK_ON(isa, ...) ((isa) == Isa::v4 ? v4::__VA_ARGS__ : (isa) == Isa::v3 ? v3::__VA_ARGS__ : base::__VA_ARGS__)
