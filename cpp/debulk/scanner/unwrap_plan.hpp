#pragma once

#include <array>
#include <vector>

namespace debulk {

constexpr int most_periods = 6;

// A combination of the wrapped phases with whole-numbered weights. It is the wrapped phase of a pattern with `periods`
// periods.
struct Synthetic {
  int periods = 0;
  std::array<int, most_periods> weights{};
};

// How to find the fringe order from phases at several numbers of periods over the field (heterodyne unwrapping). The
// first stage has one period, so its phase is absolute. Each further stage is unwrapped by the one before, up to the
// greatest number of periods, from which the orders of all given ones follow.
struct UnwrapPlan {
  std::vector<int> periods;
  std::vector<Synthetic> stages;
  int top = 0;  // index of the greatest number of periods
  // Standard deviation of the least certain fringe order, in orders, if that of each wrapped phase is one turn.
  double order_noise = 0;
};

// Returns the plan whose least certain order is the most certain. Throws InputError if no combination of the periods
// has one period (because they have a common divisor or are too far apart), if two of them are equal or one is not
// within 1 to 10000, or if there are fewer than two or more than six.
UnwrapPlan plan_unwrapping(const std::vector<int>& periods);

}  // namespace debulk
