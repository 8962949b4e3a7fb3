#include "debulk/scanner/unwrap_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <set>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

double squared(const Synthetic& s) {
  double sum = 0;
  for (int w : s.weights) sum += w * w;
  return sum;
}

// Standard deviation of the order when `fine` is unwrapped by `coarse`. Both are combinations of the same measured
// phases.
double step_noise(const Synthetic& coarse, const Synthetic& fine) {
  const double ratio = static_cast<double>(fine.periods) / coarse.periods;
  double sum = 0;
  for (std::size_t i = 0; i < most_periods; ++i) sum += std::pow(ratio * coarse.weights[i] - fine.weights[i], 2);
  return std::sqrt(sum);
}

// The combination of least noise for each number of periods up to the greatest given number.
std::vector<Synthetic> combinations(const std::vector<int>& periods) {
  const int count = static_cast<int>(periods.size()), reach = count <= 3 ? 6 : count == 4 ? 3 : 2;
  const int greatest = *std::max_element(periods.begin(), periods.end());
  std::map<int, Synthetic> best;
  Synthetic s;
  for (int i = 0; i < count; ++i) s.weights[static_cast<std::size_t>(i)] = -reach;
  for (bool more = true; more;) {
    s.periods = 0;
    for (int i = 0; i < count; ++i) s.periods += s.weights[static_cast<std::size_t>(i)] * periods[static_cast<std::size_t>(i)];
    if (s.periods >= 1 && s.periods <= greatest) {
      const auto [at, added] = best.emplace(s.periods, s);
      if (!added && squared(s) < squared(at->second)) at->second = s;
    }
    more = false;
    for (int i = 0; i < count && !more; ++i) {  // the next combination
      int& w = s.weights[static_cast<std::size_t>(i)];
      more = w < reach;
      w = more ? w + 1 : -reach;
    }
  }
  std::vector<Synthetic> out;
  for (const auto& [_, one] : best) out.push_back(one);
  return out;
}

}  // namespace

UnwrapPlan plan_unwrapping(const std::vector<int>& periods) {
  require(periods.size() >= 2 && periods.size() <= most_periods, "periods", "two to six numbers", periods.size());
  for (int n : periods) require(n >= 1 && n <= 10000, "periods", "numbers of 1 to 10000", n);
  require(std::set<int>(periods.begin(), periods.end()).size() == periods.size(), "periods", "different numbers", "one twice");

  UnwrapPlan plan;
  plan.periods = periods;
  plan.top = static_cast<int>(std::max_element(periods.begin(), periods.end()) - periods.begin());
  const std::vector<Synthetic> nodes = combinations(periods);
  require(nodes.front().periods == 1, "periods", "numbers from which one period over the field can be combined, like 50 and 51",
          "numbers with a common divisor, or too far apart");

  // Finds the path from one period to the greatest number of periods whose worst step is the best and, among those,
  // the shortest. One pass is enough, because the nodes stand in the order of their periods and steps only go up.
  const std::size_t count = nodes.size();
  std::vector<double> worst(count, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> steps(count, 0), before(count, 0);
  worst[0] = 0;
  for (std::size_t j = 1; j < count; ++j)
    for (std::size_t i = 0; i < j; ++i) {
      const double here = std::max(worst[i], step_noise(nodes[i], nodes[j]));
      if (here > worst[j] * (1 + 1e-9) || (here > worst[j] * (1 - 1e-9) && steps[i] + 1 >= steps[j])) continue;
      worst[j] = here, steps[j] = steps[i] + 1, before[j] = i;
    }
  for (std::size_t k = count - 1; k != 0; k = before[k]) plan.stages.insert(plan.stages.begin(), nodes[k]);
  plan.stages.insert(plan.stages.begin(), nodes[0]);
  plan.order_noise = worst[count - 1];
  return plan;
}

}  // namespace debulk
