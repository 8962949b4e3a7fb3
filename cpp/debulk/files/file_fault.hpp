#pragma once

#include <stdexcept>
#include <string>

namespace debulk {

// What is wrong with a file, and at which byte of it. The caller, who knows the file's name, turns it into an InputError.
class FileFault : public std::runtime_error {
 public:
  FileFault(long long byte, const std::string& problem) : std::runtime_error(problem), byte_(byte) {}
  long long byte() const { return byte_; }

 private:
  long long byte_;
};

// Reads exactly `bytes` bytes at `offset`; a file that ends before, or cannot be read, is a FileFault. Any number of
// threads may read from one descriptor: its own position is neither used nor moved.
void read_at(int file, long long offset, void* into, long long bytes);

}  // namespace debulk
