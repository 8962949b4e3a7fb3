#pragma once

#include <array>
#include <limits>

namespace debulk {

// What a loader needs to know about the points that it has read, to refuse points that cannot be a scan. It is
// gathered while the points are still in the cache. NaN is ignored, and so is (0, 0, 0), which some scanners write where
// nothing was seen. The result depends neither on the chunks nor on the order in which they are merged.
struct PointSummary {
  static constexpr float infinity = std::numeric_limits<float>::infinity();

  std::array<float, 3> low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  long at_origin = 0;  // number of points at exactly (0, 0, 0)

  void merge(const PointSummary& other);
};

PointSummary summarise(const float* xyz, long count);

// Multiplies the points by `factor` (in double precision; 1 leaves every bit alone) and summarises them.
PointSummary scale_and_summarise(float* xyz, long count, double factor, int threads = 0);

}  // namespace debulk
