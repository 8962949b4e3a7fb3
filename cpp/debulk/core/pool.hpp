#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace debulk {

// Keeps objects whose buffers are worth reusing. A thread borrows one, and it returns to the pool when the thread
// releases it.
template <class T>
class Pool {
 public:
  std::shared_ptr<T> borrow() {
    std::unique_ptr<T> one;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!spare_.empty()) one = std::move(spare_.back()), spare_.pop_back();
    }
    if (!one) one = std::make_unique<T>();
    return {one.release(), [this](T* back) {
              const std::lock_guard<std::mutex> lock(mutex_);
              spare_.emplace_back(back);
            }};
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> spare_;
};

}  // namespace debulk
