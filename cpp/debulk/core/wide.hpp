#pragma once

// Marks a function that is compiled for several instruction sets, with which the compiler takes several values of its loops at
// a time: no sum changes its order, so that the bits are the same. Where a loop is written with wide vectors itself,
// see simd.hpp. Not under a sanitizer: its builds take one value at a time anyway, and the version would be chosen before the
// thread sanitizer has started, which GCC has that choice call, too.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define DEBULK_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define DEBULK_WIDE
#endif
