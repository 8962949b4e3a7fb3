#pragma once

#include <functional>

#include "debulk/core/stop.hpp"

namespace debulk {

// Number of threads that is used when the caller asks for 0: as many as the process may run on.
int default_threads();

// Calls body(begin, end) on consecutive chunks of [0, count), each of `chunk` items (the last may be shorter), on up
// to `threads` threads (0: default_threads()). The chunks do not depend on the number of threads: if the body writes
// only to places of its own chunk, the result is the same to the bit on any number of threads. The first exception (in
// the order of the chunks) is rethrown after every thread has ended.
void parallel_for(long count, long chunk, int threads, const std::function<void(long begin, long end)>& body);
// The same, but throws Stopped soon after the stop is raised; no further chunk is begun then.
void parallel_for(long count, long chunk, int threads, const Stop& stop, const std::function<void(long begin, long end)>& body);

}  // namespace debulk
