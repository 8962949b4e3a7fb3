#pragma once

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

// Memory taken by a test program's C++ code; tests look at the difference. For one source file of a program: it replaces
// the operators new and delete. Not inlined, where GCC takes free for a mismatch of the new it sees beside it.
inline std::atomic<long> bytes_taken{0}, largest_taken{0};

inline void* take(std::size_t size) {
  bytes_taken += static_cast<long>(size);
  if (static_cast<long>(size) > largest_taken) largest_taken = static_cast<long>(size);
  return std::malloc(std::max<std::size_t>(size, 1));
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return take(size);
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* p = take(size)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new[](std::size_t size) {
  return operator new(size);
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete[](void* p) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete[](void* p, std::size_t) noexcept {
  std::free(p);
}
