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
  double spike = 0.0;  // mm; heights that stand out further are no ply (see median.hpp). 0: none is looked for
  int median = 3;      // cells: 1 (none), 3 or 5

  void check() const;
};

// From a scan to its height map above one reference, cycle after cycle: outliers removed, heights on a grid, holes filled,
// spikes, median. Everything that depends on the reference and the camera alone is prepared once, and the buffers stay.
//
// The scan of a pinhole camera takes the fast way: outliers by PinholeOutliers, heights along the rays, ImageGridding. Any
// other takes the general one, by remove_outliers and grid_heights.
class FrontEnd {
 public:
  // Without a pinhole camera every scan takes the general way. Points are in the scanner's frame. low, high: the box of the mold's XY
  // plane that the grid is to cover, cut to the reference's. seen: what the reference was fitted to; null: it is known everywhere.
  FrontEnd(std::shared_ptr<const Reference> reference, const Eigen::Vector2d& low, const Eigen::Vector2d& high, const View& view,
           bool pinhole, const FrontEndOptions& options, int threads = 0, const Grid<float>* seen = nullptr);

  // The height map stays valid until the next call. Throws Stopped within some milliseconds when the stop is raised (before
  // the search of a cloud that is no pinhole's has begun or ended, within some tenths of a second). The scan is copied first:
  // a scanner that writes the next one into the same memory meanwhile gives wrong heights, and no wrong indices.
  const HeightMap& run(const CloudView& scan, const Stop& stop = Stop());

  // Of the last run.
  Overview overview() const;  // on the same points whatever the box
  bool fast() const { return fast_; }
  // What gridding blurred the heights with, as a variance along x and along y: a top of curvature -c along both is lower by c times that.
  double blur_mm2() const { return fast_ ? gridding_->blur_mm2() : map_.heights.spacing * map_.heights.spacing / 6; }
  const Outliers& outliers() const { return outliers_; }  // but which points; see `keep`
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
  HoleFilling filling_;
  Outliers outliers_;
  HeightMap map_;
  bool fast_ = false;
  Times times_;
};

}  // namespace debulk
