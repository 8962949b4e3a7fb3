#include "debulk/files/file_fault.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace debulk {

void read_at(int file, long long offset, void* into, long long bytes) {
  char* place = static_cast<char*>(into);
  while (bytes > 0) {
    // Linux reads at most 2 GB per call.
    const ssize_t got = ::pread(file, place, static_cast<std::size_t>(std::min(bytes, 1LL << 30)), offset);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw FileFault(offset, std::string("cannot be read: ") + std::strerror(errno));
    if (got == 0) throw FileFault(offset, "the file ended while it was read");
    place += got;
    offset += got;
    bytes -= got;
  }
}

}  // namespace debulk
