#pragma once

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>

// Memory taken by a test program's C++ code; tests look at the difference. For one source file of a program: it replaces
// the operators new and delete.
inline std::atomic<long> bytes_taken{0}, largest_taken{0};

inline void* take(std::size_t size) {
  bytes_taken += static_cast<long>(size);
  if (static_cast<long>(size) > largest_taken) largest_taken = static_cast<long>(size);
  if (void* p = std::malloc(std::max<std::size_t>(size, 1))) return p;
  throw std::bad_alloc();
}
void* operator new(std::size_t size) {
  return take(size);
}
void* operator new[](std::size_t size) {
  return take(size);
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete[](void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
void operator delete[](void* p, std::size_t) noexcept {
  std::free(p);
}
