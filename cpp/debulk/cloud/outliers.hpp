#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

struct OutlierOptions {
  int neighbours = 4;      // number of nearest neighbours whose mean distance decides
  double std_ratio = 1.0;  // standard deviations above the mean from which a point is an outlier
  // A point is never one below so many times the mean; 0 is pcdenoise. In a scan that has been cleaned already the
  // deviation is so small that the flanks of a bell, where points lie farther apart, would be removed: 2 keeps them.
  double least_ratio = 0.0;

  void check() const;
};

struct Outliers {
  std::vector<std::uint8_t> keep;  // one per point: 1 stays, 0 is an outlier or was not seen
  double mean = 0.0;               // mm, of the points' mean distances to their neighbours
  double deviation = 0.0;          // mm, their sample standard deviation (n - 1)
  double threshold = 0.0;          // mm, mean + std_ratio * deviation, at least least_ratio * mean
  long seen = 0;
  long removed = 0;
};

// Finds the points whose mean distance to their nearest neighbours (themselves not counted) exceeds the mean plus
// std_ratio sample standard deviations of that figure over all points: what MATLAB's pcdenoise does, by exact search. A
// cloud with a single point keeps it. Throws Stopped when the Stop is raised.
Outliers remove_outliers(const CloudView& cloud, const OutlierOptions& options = {}, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
