#pragma once

#include <chrono>

namespace debulk {

// Measures the wall time of the stages of a run.
class Clock {
 public:
  // Milliseconds since the last call or, on the first call, since the clock was constructed.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double passed = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return passed;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace debulk
