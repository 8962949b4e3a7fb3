#pragma once

namespace debulk {

// Which instructions a wide loop uses. Sources with wide loops put them into a file that is included once for each of
// these, in a namespace of its own and compiled for it, and choose at run time; they do the same operations in the same
// order, without fused multiply-add: the same bits on each. (target_clones would split wide vectors before it clones.)
enum class Isa { base, v3, v4 };

// The widest that this machine has.
Isa best_isa();

}  // namespace debulk

#define DEBULK_INLINE inline __attribute__((always_inline))
#define DEBULK_LAMBDA __attribute__((always_inline))
