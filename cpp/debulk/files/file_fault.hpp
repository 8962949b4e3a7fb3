#pragma once

#include <stdexcept>
#include <string>

namespace debulk {

// Says what is wrong with a file, and at which byte. The caller, who knows the file's name, turns it into an
// InputError.
class FileFault : public std::runtime_error {
 public:
  FileFault(long long byte, const std::string& problem) : std::runtime_error(problem), byte_(byte) {}
  long long byte() const { return byte_; }

 private:
  long long byte_;
};

// Reads exactly `bytes` bytes at `offset`. Throws FileFault if the file ends before that or cannot be read. Any number
// of threads may read from one descriptor, because the descriptor's own position is neither used nor moved.
void read_at(int file, long long offset, void* into, long long bytes);

}  // namespace debulk
