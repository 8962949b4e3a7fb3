#include "debulk/solve/ipopt_lock.hpp"

#include <pthread.h>

namespace debulk {

namespace {

std::mutex one_at_a_time;

// The thread that forks holds the lock during the fork, in the child too, where it is the only thread.
void hold() {
  one_at_a_time.lock();
}
void release() {
  one_at_a_time.unlock();
}

[[maybe_unused]] const int registered = pthread_atfork(hold, release, release);

}  // namespace

std::unique_lock<std::mutex> ipopt_lock() {
  return std::unique_lock<std::mutex>(one_at_a_time);
}

}  // namespace debulk
