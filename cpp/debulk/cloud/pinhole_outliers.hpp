#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "debulk/cloud/open_search.hpp"
#include "debulk/cloud/outliers.hpp"
#include "debulk/cloud/window_pass.hpp"

namespace debulk {

// Does what remove_outliers does, for the organised cloud of a pinhole camera, as exactly and many times faster. The
// decisions are the same, except where a mean distance and the threshold agree to 1e-6. Owns its buffers, so that
// further clouds of the same size allocate little.
class PinholeOutliers {
 public:
  // The expected threshold: that of the last cloud (0: unknown). Only the time depends on it.
  double guess = 0;
  // How far points may lie off their rays, in pixels. A cloud whose points lie farther off gets pinhole_tolerance, and
  // a second pass. The next cloud begins with this value again, because its figures must not depend on clouds before
  // it, not even by rounding.
  double tolerance = 0.01;
  // The threshold is that of all points, or, if the window leaves more than so many open (open_search.hpp), of every
  // second, third … of these, weighted accordingly. All decisions are exact for this threshold.
  std::size_t most_measured = std::numeric_limits<std::size_t>::max();
  Isa isa = best_isa();
  // If false, the four nearest of the 5 by 5 pixels round a point are taken as its nearest without proof. This short
  // cut is for comparison.
  bool certified = true;

  // Returns false if the cloud is not a pinhole camera's, has too few points or too many off the sheet, or if the
  // number of neighbours is not four. Nothing was decided then, and remove_outliers is to be used. If `base` is given,
  // heights are computed. Throws Stopped when the stop is raised.
  bool run(const CloudView& cloud, const Pinhole& camera, const OutlierOptions& options, const RayBase* base, int threads = 0,
           const Stop& stop = Stop());

  const std::vector<std::uint8_t>& keep() const { return states_; }  // one per pixel, 0 or 1
  const std::vector<float>& heights() const { return heights_; }     // mm above the base, NaN if dropped; and some more
  // The memory of the heights may be used for something else between two runs. An array of at least heights_for()
  // floats is not allocated anew.
  void swap_heights(std::vector<float>& other) { heights_.swap(other); }
  static std::size_t heights_for(int width, int height) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height + 1) + 48;
  }
  const Tiles& tiles() const { return tiles_; }
  const Outliers& summary() const { return summary_; }  // all but `keep`, which stays empty

 private:
  double least_threshold(WindowPass& window, const OutlierOptions& options, int threads, const Stop& stop);
  bool pass(WindowPass& window, double& tolerance_px, int threads, const Stop& stop);

  std::vector<std::uint8_t> states_;
  std::vector<float> heights_, distances_;
  Tiles tiles_;
  std::vector<WindowBand> bands_;
  OpenSearch search_;
  Outliers summary_;
};

}  // namespace debulk
