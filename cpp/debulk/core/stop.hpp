#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>

namespace debulk {

// Thrown, when its Stop is raised, by a computation that has no useful result halfway.
class Stopped : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Says when a computation is to stop early: at a deadline, when another thread raises a flag, or at whichever comes
// first. Copies share the flag.
class Stop {
 public:
  using Clock = std::chrono::steady_clock;

  Stop() : cancelled_(std::make_shared<std::atomic<bool>>(false)) {}
  explicit Stop(double seconds) : Stop() { set_deadline(seconds); }

  // Sets the deadline to so many seconds from now. An infinite time, or one too long for the clock to count, leaves
  // the deadline as it is.
  void set_deadline(double seconds) {
    const Clock::time_point now = Clock::now();
    if (seconds < std::chrono::duration<double>(Clock::time_point::max() - now).count() - 1)
      deadline_ = now + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }
  void cancel() const { cancelled_->store(true, std::memory_order_relaxed); }
  bool cancelled() const { return cancelled_->load(std::memory_order_relaxed); }
  bool past_deadline() const { return deadline_ != Clock::time_point::max() && Clock::now() >= deadline_; }
  bool now() const { return cancelled() || past_deadline(); }

 private:
  Clock::time_point deadline_ = Clock::time_point::max();
  std::shared_ptr<std::atomic<bool>> cancelled_;
};

}  // namespace debulk
