#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace debulk {

// A point from which the flood goes on, with the lowest height on the way to it.
struct Front {
  float level;
  int i, j;
};

// The fronts of the flood, highest first, to 1/256 mm. Equal ones come in the order in which they were added. In a
// flood levels only fall.
class Fronts {
 public:
  Fronts(double low, double high)
      : low_(low), bins_(static_cast<std::size_t>(std::max(high - low, 0.0) * kPerMm) + 1), at_(bins_.size() - 1) {}

  void push(const Front& front) {
    const double bin = std::clamp((front.level - low_) * kPerMm, 0.0, static_cast<double>(at_));
    Bin& to = bins_[static_cast<std::size_t>(bin)];
    const int here = static_cast<int>(links_.size());
    (to.first == kNone ? to.first : links_[static_cast<std::size_t>(to.last)].next) = here;
    to.last = here;
    links_.push_back({front, kNone});
  }

  bool pop(Front& front) {
    while (bins_[at_].first == kNone) {
      if (at_ == 0) return false;
      --at_;
    }
    const Link& link = links_[static_cast<std::size_t>(bins_[at_].first)];
    front = link.front, bins_[at_].first = link.next;
    return true;
  }
  // The front that is likely to be the next; null: it is not known yet.
  const Front* next() const {
    const int first = bins_[at_].first;
    return first == kNone ? nullptr : &links_[static_cast<std::size_t>(first)].front;
  }

 private:
  static constexpr double kPerMm = 256;
  static constexpr int kNone = -1;
  // The fronts of all bins lie in one array, linked bin by bin, because thousands of bins with memory of their own
  // cost more than the flood.
  struct Link {
    Front front;
    int next;
  };
  struct Bin {
    int first = kNone, last = kNone;
  };
  double low_;
  std::vector<Bin> bins_;
  std::vector<Link> links_;
  std::size_t at_;  // no front is in a higher bin
};

}  // namespace debulk
