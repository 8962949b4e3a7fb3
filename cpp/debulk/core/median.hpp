#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace debulk {

// The value that stands at a place in the order of sizes; reorders the values.
template <class T>
T select(std::vector<T>& values, std::size_t place) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The upper median of values without NaN, 0 if there are none; may reorder them. A sample tells between which values it
// lies, if there are many; it is selected among the few of these.
template <class T>
T upper_median(std::vector<T>& values) {
  constexpr std::size_t kMany = 100'000, kEvery = 64;
  if (values.empty()) return 0;
  const std::size_t middle = values.size() / 2;
  if (values.size() > kMany) {
    std::vector<T> sample, between;
    for (std::size_t k = 0; k < values.size(); k += kEvery) sample.push_back(values[k]);
    const T low = select(sample, sample.size() * 48 / 100), high = select(sample, sample.size() * 52 / 100);
    std::size_t below = 0;
    for (const T v : values) {
      below += v < low;
      if (v >= low && v <= high) between.push_back(v);
    }
    if (below <= middle && middle < below + between.size()) return select(between, middle - below);
  }
  return select(values, middle);
}

}  // namespace debulk
