#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "debulk/cloud/neighbours.hpp"
#include "debulk/cloud/pinhole_outliers.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/fill_holes.hpp"
#include "debulk/surface/height_map.hpp"
#include "debulk/surface/image_gridding.hpp"
#include "debulk/surface/overview.hpp"

namespace debulk {

struct FrontEndOptions {
  OutlierOptions outliers;
  double spacing = 0.5;  // mm, of the height map
  GriddingOptions gridding;
  FillOptions fill;
  double spike = 0.0;  // mm; heights that stand out further are not ply (see median.hpp); 0: spikes stay
  int median = 3;      // cells: 1 (no median), 3 or 5

  void check() const;
};

// Turns a scan into its height map above one reference, cycle after cycle: removes outliers, puts the heights on a
// grid, fills holes, removes spikes and applies a median. Everything that depends only on the reference and the camera
// is prepared once, and the buffers are reused.
//
// The scan of a pinhole camera is processed the fast way: outliers by PinholeOutliers, heights along the rays,
// ImageGridding. Any other scan is processed the general way, by remove_outliers and grid_heights.
class FrontEnd {
 public:
  // Without a pinhole camera every scan is processed the general way. Points are in the scanner's frame. low, high:
  // the box of the mold's XY plane that the grid is to cover; it is cut to the reference's grid. seen: the heights to
  // which the reference was fitted; null: it is known everywhere. Throws InputError.
  FrontEnd(std::shared_ptr<const Reference> reference, const Eigen::Vector2d& low, const Eigen::Vector2d& high, const View& view,
           bool pinhole, const FrontEndOptions& options, int threads = 0, const Grid<float>* seen = nullptr);

  // The height map stays valid until the next call. Throws Stopped within some milliseconds when the stop is raised
  // (within some tenths of a second before the search of a cloud that is not a pinhole camera's has begun or ended).
  // A scanner that writes the next scan into the same memory meanwhile may cause wrong heights, but no wrong indices: the
  // fast way computes none from points that it reads twice, and the general way copies the scan first.
  const HeightMap& run(const CloudView& scan, const Stop& stop = Stop());

  // Results of the last run.
  const HeightMap& map() const { return map_; }
  Overview overview() const { return overview_of(map_, gaps_); }
  bool fast() const { return fast_; }
  // How much gridding blurred the heights, as a variance along x and along y: a top of curvature -c along both is
  // lower by c times this.
  double blur_mm2() const { return fast_ ? gridding_->blur_mm2() : blur_; }
  const Outliers& outliers() const { return outliers_; }  // without `keep`, for which see below
  const std::vector<std::uint8_t>& keep() const { return fast_ ? image_.keep() : outliers_.keep; }
  struct Times {
    double clean = 0, grid = 0, fill = 0, spikes = 0, median = 0;  // ms
  };
  const Times& times() const { return times_; }

 private:
  CloudView copied(const CloudView& scan, const Stop& stop);
  void grid_generally(const CloudView& scan, const Stop& stop);

  std::shared_ptr<const Reference> reference_;
  View view_;
  FrontEndOptions options_;
  int threads_;
  ReferenceGaps gaps_;
  RayBase base_;
  std::optional<ImageGridding> gridding_;
  PinholeOutliers image_;
  std::vector<float> scan_;
  double blur_ = 0;                      // mm2, of the general way
  std::vector<Eigen::Vector2f> sparse_;  // places round which it was given few points
  HoleFilling filling_;
  Outliers outliers_;
  HeightMap map_;
  bool fast_ = false;
  Times times_;
};

}  // namespace debulk
