#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/pinhole_outliers.hpp"
#include "debulk/core/pool.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Part of an organised cloud, copied, what the mask hides (nonzero) made missing: an image of its own, whose camera looks
// through another principal point. Rows are padded to a multiple of 16 pixels with missing ones.
struct CloudPart {
  int column = 0, row = 0, width = 0, height = 0;  // pixels; column a multiple of 16
  std::vector<float> points;

  void copy(const CloudView& cloud, const std::uint8_t* masked);
  CloudView view() const { return {points.data(), width, height}; }
  Pinhole camera(const Pinhole& whole) const { return {whole.f, whole.cx - column, whole.cy - row}; }
};

// The outlier threshold of a whole cloud, estimated from parts of it.
struct SampledThreshold {
  double mean = 0, deviation = 0;  // mm, of the points' mean distances to their four neighbours
  double value = 0;                // mm
  double error = 0;                // mm, standard error, from how much the parts differ (jackknife)
  long points = 0;                 // in the sample
  bool pinhole = false;            // false: the cloud is not a pinhole camera's, and nothing is known
};

// Samples blocks of pixels, spread evenly over the image with a jitter: a twentieth of it or a million at least; all of an
// image of up to two million. What a block's border does is left out: its outermost points do not count, nor flying ones
// near it, whose neighbours may be outside; those farther in stand for them. Keeps its memory.
class ThresholdSampler {
 public:
  // Throws Stopped.
  SampledThreshold run(const CloudView& cloud, const std::uint8_t* masked, const Pinhole& camera, const OutlierOptions& options,
                       int threads, const Stop& stop);

 private:
  struct Block {
    CloudPart part;
    PinholeOutliers outliers;
  };
  Pool<Block> blocks_;
};

}  // namespace debulk
