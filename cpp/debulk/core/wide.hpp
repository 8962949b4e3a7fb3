#pragma once

// Marks a function that is compiled for several instruction sets, with which the compiler takes several values of its loops at
// a time: no sum changes its order, so that the bits are the same. Where a loop is written with wide vectors itself,
// see simd.hpp.
#if defined(__x86_64__)
#define DEBULK_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define DEBULK_WIDE
#endif
