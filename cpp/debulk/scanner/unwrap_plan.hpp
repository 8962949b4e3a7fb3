#pragma once

#include <array>
#include <vector>

namespace debulk {

constexpr int most_periods = 6;

// A whole-numbered combination of the wrapped phases: the wrapped phase of a pattern with `periods` periods.
struct Synthetic {
  int periods = 0;
  std::array<int, most_periods> weights{};
};

// How to find the fringe order from phases at several numbers of periods over the field (heterodyne unwrapping). The first
// stage has one period, so that its phase is absolute; each further one is unwrapped by the one before, up to the greatest
// number of periods, from which all given ones follow.
struct UnwrapPlan {
  std::vector<int> periods;
  std::vector<Synthetic> stages;
  int top = 0;  // index of the greatest number of periods
  // Standard deviation of the least certain fringe order, in orders, for a wrapped phase's of one turn.
  double order_noise = 0;
};

// The plan whose least certain order is the surest. Throws where the periods have a common divisor (then no combination has
// one period), are not different, or are fewer than two or more than six.
UnwrapPlan plan_unwrapping(const std::vector<int>& periods);

}  // namespace debulk
