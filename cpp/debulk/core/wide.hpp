#pragma once

// Marks a function that is compiled for several instruction sets, with which the compiler takes several values of its loops at
// a time: no sum changes its order, so that the bits are the same. Where a loop is written with wide vectors itself,
// see simd.hpp. The version is chosen before the thread sanitizer has started, which GCC has that choice call, too.
#if defined(__x86_64__) && !defined(__SANITIZE_THREAD__)
#define DEBULK_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define DEBULK_WIDE
#endif
