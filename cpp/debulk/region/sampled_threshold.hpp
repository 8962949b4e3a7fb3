#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/pinhole_outliers.hpp"
#include "debulk/core/pool.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// A copy of part of an organised cloud, in which the pixels that the mask hides (nonzero) are missing. It is an image
// of its own, whose camera has another principal point. Rows are padded with missing pixels to a multiple of 16.
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
  double error = 0;                // mm, standard error, from the differences between the parts (jackknife)
  long points = 0;                 // number of points in the sample
  bool pinhole = false;            // false: the cloud is not a pinhole camera's, and the other members have no meaning
};

// Samples blocks of pixels, spread evenly over the image with a jitter: about a twentieth of the image or a million
// pixels, whichever is more, and all of an image of up to two million. The effect of a block's border is left out: the
// outermost points do not count, and neither do flying points near the border, whose neighbours may lie outside; flying
// points farther in are weighted to replace them. The sampler keeps its memory between runs.
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
