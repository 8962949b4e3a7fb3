#pragma once

#include <optional>
#include <vector>

#include "debulk/cloud/open_search.hpp"
#include "debulk/cloud/outliers.hpp"
#include "debulk/cloud/window_pass.hpp"

namespace debulk {

// remove_outliers for the organised cloud of a pinhole camera, many times faster and as exact: the same decisions, but
// where a mean distance and the threshold agree to 1e-6. Owns its buffers: the second cloud of a size allocates little.
class PinholeOutliers {
 public:
  // The threshold from the last cloud, or from elsewhere (0: unknown); only the time depends on it.
  double guess = 0;
  // How far points lie off their rays, in pixels. A cloud that needs it gets pinhole_tolerance, and a second pass; the next
  // begins with this again: its figures must not depend on those before it, not even by rounding.
  double tolerance = 0.01;
  // A threshold that is known already, for a part of a cloud (0: the cloud's own). Then no cloud has too few points or too
  // many off the sheet; the summary's mean and deviation are still the part's own.
  double fixed = 0;
  // With `fixed`: only the decisions are wanted. The summary's mean and deviation and open_distance() mean nothing then.
  bool decisions_only = false;
  Isa isa = best_isa();
  // False: the four nearest of the 5 by 5 pixels round a point are believed without a certificate: a short cut, for
  // comparison.
  bool certified = true;

  // False: not a pinhole's cloud (or too few points, too many off the sheet, another number of neighbours than four):
  // nothing was decided, and remove_outliers is to be asked. `base`, if given, makes heights. Throws Stopped when the stop is raised.
  bool run(const CloudView& cloud, const Pinhole& camera, const OutlierOptions& options, const RayBase* base, int threads = 0,
           const Stop& stop = Stop());

  const std::vector<std::uint8_t>& keep() const { return states_; }  // one per pixel, 0 or 1
  const std::vector<float>& heights() const { return heights_; }     // above the base, NaN where not kept; and some more
  // The memory of the heights may be used for something else between two runs. An array of at least that many is not
  // allocated anew.
  void swap_heights(std::vector<float>& other) { heights_.swap(other); }
  static std::size_t heights_for(int width, int height) {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height + 1) + 48;
  }
  const Tiles& tiles() const { return tiles_; }
  const Outliers& summary() const { return summary_; }  // but its keep, which stays empty
  long open() const { return static_cast<long>(distances_.size()); }
  // The points that the pixel window left open, and their distances (infinite: alone).
  std::uint32_t open_pixel(long k) const { return search_.pixel(static_cast<std::size_t>(k)); }
  float open_distance(long k) const { return distances_[static_cast<std::size_t>(k)]; }

 private:
  bool pass(WindowPass& window, double& tolerance_px, int threads, const Stop& stop);

  std::vector<std::uint8_t> states_;
  std::vector<float> heights_, distances_;
  Tiles tiles_;
  std::vector<WindowBand> bands_;
  OpenSearch search_;
  Outliers summary_;
};

}  // namespace debulk
