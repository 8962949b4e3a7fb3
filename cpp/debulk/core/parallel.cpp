#include "debulk/core/parallel.hpp"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>
#include <vector>

#include "debulk/core/error.hpp"

namespace debulk {

int default_threads() {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) return std::max(1, CPU_COUNT(&allowed));
  return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

void parallel_for(long count, long chunk, int threads, const std::function<void(long, long)>& body) {
  require(chunk > 0, "chunk", "a positive number of items", chunk);
  require(threads >= 0, "threads", "0 (as many as the process may use) or more", threads);
  if (count <= 0) return;
  const long chunks = (count + chunk - 1) / chunk;
  const long workers = std::min<long>(chunks, threads == 0 ? default_threads() : threads);

  std::vector<std::exception_ptr> failures(static_cast<std::size_t>(chunks));
  std::atomic<long> next{0};
  std::atomic<bool> failed{false};
  const auto work = [&] {
    for (long k = next++; k < chunks && !failed; k = next++) {
      try {
        body(k * chunk, std::min(count, (k + 1) * chunk));
      } catch (...) {
        failures[static_cast<std::size_t>(k)] = std::current_exception();
        failed = true;
      }
    }
  };

  std::vector<std::thread> others;
  others.reserve(static_cast<std::size_t>(workers - 1));
  try {
    for (long w = 1; w < workers; ++w) others.emplace_back(work);
  } catch (const std::system_error&) {  // the machine gives no more threads: those that are there do all chunks
  }
  work();
  for (std::thread& other : others) other.join();
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

void parallel_for(long count, long chunk, int threads, const Stop& stop, const std::function<void(long, long)>& body) {
  parallel_for(count, chunk, threads, [&](long begin, long end) {
    if (stop.now()) throw Stopped("the computation was stopped");
    body(begin, end);
  });
}

}  // namespace debulk
