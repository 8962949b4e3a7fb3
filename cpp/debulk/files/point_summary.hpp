#pragma once

#include <array>
#include <limits>

namespace debulk {

// What a loader has to know of the points it read, to refuse those that cannot be a scan: gathered while they are still in
// the cache. NaN is passed over. Neither the order of merging nor the chunks change it.
struct PointSummary {
  static constexpr float infinity = std::numeric_limits<float>::infinity();

  std::array<float, 3> low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  long sampled = 0;    // points looked at for the next figure: every 16th
  long at_origin = 0;  // of these, at exactly (0, 0, 0): what some scanners write where nothing was seen

  void merge(const PointSummary& other);
};

// Of points that are the `first` and following of a cloud.
PointSummary summarise(const float* xyz, long first, long count);

// Multiplies by `factor` (in double precision; 1 leaves every bit alone) and summarises.
PointSummary scale_and_summarise(float* xyz, long count, double factor, int threads = 0);

}  // namespace debulk
