#include "debulk/pocket/drop_out.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "debulk/core/point_index.hpp"

namespace debulk {
namespace {

constexpr std::size_t kBetweenChecks = 16384;  // points, which take a fraction of a millisecond

// Breadth-first search from the known heights round a component inwards.
class Flood {
 public:
  Flood(const Grid<float>& heights, const std::vector<std::size_t>& component, const Stop& stop)
      : heights_(heights), component_(component), index_(component, heights.nx), reached_(component.size(), 0), stop_(stop) {}

  // The first step, from the known heights. Returns whether one of these is at least `rim`.
  bool enter(double rim) {
    bool high = false;
    for (std::size_t n = 0; n < component_.size(); ++n) {
      look();
      bool next_to = false;
      around(n, [&](int i, int j) {
        const float h = heights_.at(i, j);
        next_to |= !std::isnan(h), high |= h >= rim;
      });
      if (next_to) reached_[n] = 1, front_.push_back(n);
    }
    left_ = component_.size() - front_.size();
    return high;
  }

  // Whether every point is reached in so many steps, including the first.
  bool all_within(long steps) {
    std::vector<std::size_t> next;
    for (long step = 2; left_ > 0 && !front_.empty() && step <= steps; ++step) {
      next.clear();
      for (const std::size_t n : front_) {
        look();
        around(n, [&](int i, int j) {
          const long other = index_.find(i, j);
          if (other < 0 || reached_[static_cast<std::size_t>(other)]) return;
          reached_[static_cast<std::size_t>(other)] = 1, --left_;
          next.push_back(static_cast<std::size_t>(other));
        });
      }
      front_.swap(next);
    }
    return left_ == 0;
  }
  std::size_t looked_at() const { return looked_at_; }

 private:
  void look() {
    if (looked_at_++ % kBetweenChecks == 0 && stop_.now()) throw Stopped("the search for drop-outs was stopped");
  }
  template <class Body>
  void around(std::size_t n, const Body& body) const {
    const int i = index_.column(n), j = index_.row(n);
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di)
        if (heights_.contains(i + di, j + dj)) body(i + di, j + dj);
  }

  const Grid<float>& heights_;
  const std::vector<std::size_t>& component_;
  PointIndex index_;
  std::vector<std::uint8_t> reached_;
  std::vector<std::size_t> front_;
  std::size_t left_ = 0, looked_at_ = 0;
  const Stop& stop_;
};

}  // namespace

bool is_drop_out(const Grid<float>& heights, const std::vector<std::size_t>& component, const DropOutOptions& options, const Stop& stop,
                 std::size_t* looked_at) {
  const double steps = std::floor((options.bridge_mm + heights.spacing) / (2 * heights.spacing));
  Flood flood(heights, component, stop);
  const bool found = flood.enter(options.rim_mm) && steps >= 1 && flood.all_within(static_cast<long>(std::min(steps, 1e9)));
  if (looked_at) *looked_at = flood.looked_at();
  return found;
}

}  // namespace debulk
