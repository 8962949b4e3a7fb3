#include "debulk/surface/front_end.hpp"

#include <algorithm>
#include <limits>

#include "debulk/cloud/pitch.hpp"
#include "debulk/cloud/transform.hpp"
#include "debulk/core/clock.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/surface/median.hpp"
#include "debulk/surface/sparse.hpp"

namespace debulk {
namespace {

constexpr double kFarPitches = 10;  // pixels so many spacings of the height map apart are not neighbours

// Open points whose distances are measured for the threshold of the outliers. In a scan of 20 megapixels, which leaves
// 95,000 open, nine samples of about this size gave it with an error of 0.3 % (rms; 0.6 % at most), by which up to 52
// pixels were decided otherwise.
constexpr std::size_t kMeasured = 8192;

}  // namespace

void FrontEndOptions::check() const {
  outliers.check();
  require(std::isfinite(spacing) && spacing > 0, "spacing_mm", "a positive length in mm", spacing);
  gridding.check();
  fill.check();
  require(std::isfinite(spike) && spike >= 0, "spike_mm", "a height in mm, or 0 to look for none", spike);
  require(median == 1 || median == 3 || median == 5, "median_cells", "1, 3 or 5", median);
}

FrontEnd::FrontEnd(std::shared_ptr<const Reference> reference, const Eigen::Vector2d& low, const Eigen::Vector2d& high, const View& view,
                   bool pinhole, const FrontEndOptions& options, int threads, const Grid<float>* seen)
    : reference_(std::move(reference)), view_(view), options_(options), threads_(threads) {
  options.check();
  transform(CloudView{}, view.mold_from_scanner);  // checks that it is rigid
  const Grid<double>& domain = reference_->heights();
  const Eigen::Vector2d last = domain.position(domain.nx - 1, domain.ny - 1);
  map_.heights = covering_grid(low.cwiseMax(domain.origin), high.cwiseMin(last), options.spacing);
  if (seen) gaps_ = ReferenceGaps(*seen, map_.heights, options.fill.diameter);
  if (!pinhole) return;
  require(view.width > 1 && view.height > 1, "shape", "an image of at least 2 by 2 pixels",
          std::to_string(view.height) + " by " + std::to_string(view.width));
  image_.most_measured = kMeasured;
  base_ = ray_base(*reference_, view_, threads);
  gridding_.emplace(*reference_, view_, map_.heights, threads);
}

CloudView FrontEnd::copied(const CloudView& scan, const Stop& stop) {
  scan_.resize(3 * scan.size());
  parallel_for(static_cast<long>(scan_.size()), 1 << 20, threads_, stop,
               [&](long begin, long end) { std::copy(scan.xyz + begin, scan.xyz + end, scan_.begin() + begin); });
  return {scan_.data(), scan.width, scan.height};
}

const HeightMap& FrontEnd::run(const CloudView& given, const Stop& stop) {
  Clock clock;
  sparse_.clear();
  Grid<float>& other = map_.before_median;  // until the median, this is a buffer for the filters
  // If there are as many cells as pixels, the copy uses the memory of the image's heights.
  const bool shared = gridding_ && map_.heights.size() >= PinholeOutliers::heights_for(view_.width, view_.height);
  if (shared && image_.heights().empty()) {  // it is not empty after a run that was stopped
    other.values.reserve(map_.heights.size());
    image_.swap_heights(other.values);
  }
  fast_ = gridding_ && given.width == view_.width && given.height == view_.height &&
          image_.run(given, view_.camera, options_.outliers, &base_, threads_, stop);
  if (fast_) {
    outliers_ = image_.summary();
    times_.clean = clock.lap();
    gridding_->run(image_, map_.heights, image_.isa, threads_, stop);
    times_.grid = clock.lap();
  } else if (const CloudView scan = copied(given, stop);
             scan.organised() && median_pitch(scan, threads_, stop) > kFarPitches * options_.spacing) {
    // The pixels are in another order than the camera's, or far too few. Neighbouring pixels then show nothing of what
    // lies between them, and the triangles between them would be as large as the map.
    outliers_ = {};
    outliers_.keep.assign(scan.size(), 0);
    std::fill(map_.heights.values.begin(), map_.heights.values.end(), std::numeric_limits<float>::quiet_NaN());
    times_.clean = clock.lap(), times_.grid = 0;
  } else {
    outliers_ = remove_outliers(scan, options_.outliers, threads_, stop);
    times_.clean = clock.lap();
    grid_generally(scan, stop);
    times_.grid = clock.lap();
  }
  if (shared) image_.swap_heights(other.values);
  gaps_.hide(map_.heights);
  filling_.run(map_.heights, options_.fill, map_.measured, threads_, stop);
  clear_round(sparse_, sparse_reach * map_.heights.spacing, map_.measured);
  times_.fill = clock.lap();
  if (options_.spike > 0) {
    without_spikes(map_.heights, options_.spike, other, threads_, stop);
    map_.heights.values.swap(other.values);
  }
  times_.spikes = clock.lap();
  other.values.clear();
  if (options_.median > 1) {
    median(map_.heights, options_.median, other, threads_, stop);
    map_.heights.values.swap(other.values);
  }
  times_.median = clock.lap();
  return map_;
}

void FrontEnd::grid_generally(const CloudView& scan, const Stop& stop) {
  std::vector<float> points = transform(scan, view_.mold_from_scanner, threads_, stop);
  parallel_for(static_cast<long>(scan.size()), 1 << 18, threads_, stop, [&](long begin, long end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
      if (outliers_.keep[k] == 0) std::fill_n(&points[3 * k], 3, std::numeric_limits<float>::quiet_NaN());
  });
  const CloudView kept{points.data(), scan.width, scan.height};
  blur_ = grid_heights(kept, map_.heights, options_.gridding, threads_, stop);
  if (kept.organised()) sparse_ = sparse_places(kept, threads_, stop);
  parallel_for(map_.heights.ny, 8, threads_, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < map_.heights.nx; ++i) {
        float& z = map_.heights.at(i, j);
        if (!std::isnan(z)) z = static_cast<float>(z - reference_->height(map_.heights.position(i, j)));
      }
  });
}

}  // namespace debulk
