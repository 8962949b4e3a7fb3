#pragma once

#include <functional>

#include "debulk/core/stop.hpp"

namespace debulk {

// Threads to use when the caller says 0: as many as the process may run on.
int default_threads();

// Calls body(begin, end) on consecutive chunks of [0, count), each of `chunk` items (the last may be shorter), on up to
// `threads` threads (0: default_threads()). Chunks do not depend on the number of threads: a body that writes only to
// places of its own chunk gives the same bits on any number of them. The first exception (in order of chunks) is rethrown
// after every thread has ended.
void parallel_for(long count, long chunk, int threads, const std::function<void(long begin, long end)>& body);
// The same; throws Stopped soon after the stop is raised: no chunk is begun any more.
void parallel_for(long count, long chunk, int threads, const Stop& stop, const std::function<void(long begin, long end)>& body);

}  // namespace debulk
