#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

struct OutlierOptions {
  int neighbours = 4;      // number of nearest neighbours whose mean distance decides
  double std_ratio = 1.0;  // standard deviations above the mean from which a point is an outlier
  // A point is never an outlier below this many times the mean; 0 gives pcdenoise. In a scan that has been cleaned
  // already, the deviation is so small that the flanks of a bell, where points lie farther apart, would be removed; 2
  // keeps them.
  double least_ratio = 0.0;

  void check() const;
};

struct Outliers {
  std::vector<std::uint8_t> keep;  // one per point: 1 stays, 0 is an outlier or was not seen
  double mean = 0.0;               // mm, mean over the points of their mean distances to their neighbours
  double deviation = 0.0;          // mm, sample standard deviation (n - 1) of the same
  double threshold = 0.0;          // mm, mean + std_ratio * deviation, at least least_ratio * mean
  long seen = 0;
  long removed = 0;
};

// Finds the points whose mean distance to their nearest neighbours (not counting themselves) exceeds the mean of that
// figure over all points by more than std_ratio sample standard deviations. This is what MATLAB's pcdenoise does, here
// by exact search. The point of a cloud with a single one is kept. Throws Stopped when the Stop is raised.
Outliers remove_outliers(const CloudView& cloud, const OutlierOptions& options = {}, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
