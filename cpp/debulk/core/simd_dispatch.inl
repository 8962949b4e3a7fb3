// Includes the file that DEBULK_KERNEL names (as a string) once per Isa, after simd_ops.inl, in the namespaces base,
// v3 and v4 inside the namespace in which this file is included. DEBULK_ON(isa, call) calls the version for `isa`.
// Sources that use this file include <cstring> and simd.hpp and are compiled with ${debulk_simd_options}, none of
// which changes a bit of the results.
namespace base {
#define DEBULK_ISA 2
#include "debulk/core/simd_ops.inl"

#include DEBULK_KERNEL
#undef DEBULK_ISA
}  // namespace base

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("arch=x86-64-v3")
namespace v3 {
#define DEBULK_ISA 3
#include "debulk/core/simd_ops.inl"

#include DEBULK_KERNEL
#undef DEBULK_ISA
}  // namespace v3
#pragma GCC pop_options

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
namespace v4 = v3;  // the same source, which takes a sanitizer's build minutes more
#else
#pragma GCC push_options
#pragma GCC target("arch=x86-64-v4")
namespace v4 {
#define DEBULK_ISA 4
#include "debulk/core/simd_ops.inl"

#include DEBULK_KERNEL
#undef DEBULK_ISA
}  // namespace v4
#pragma GCC pop_options
#endif
#else
namespace v3 = base;
namespace v4 = base;
#endif
#undef DEBULK_KERNEL
