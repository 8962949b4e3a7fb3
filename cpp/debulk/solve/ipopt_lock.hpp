#pragma once

#include <mutex>

namespace debulk {

// Held while Ipopt runs. Neither it nor MUMPS is thread-safe: a process solves one problem with them at a time. A fork
// waits until the solve that runs has ended, so that the child finds both in order and the lock open.
std::unique_lock<std::mutex> ipopt_lock();

}  // namespace debulk
