#include "debulk/core/simd.hpp"

namespace debulk {

Isa best_isa() {
#if defined(__x86_64__) && !(defined(__clang__) && __clang_major__ < 16)  // which does not know the levels' names
  static const Isa best = __builtin_cpu_supports("x86-64-v4") ? Isa::v4 : __builtin_cpu_supports("x86-64-v3") ? Isa::v3 : Isa::base;
  return best;
#else
  return Isa::base;
#endif
}

}  // namespace debulk
