#pragma once

#include <memory>
#include <string>
#include <vector>

#include "debulk/core/pool.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/region/region.hpp"
#include "debulk/region/sampled_threshold.hpp"
#include "debulk/surface/overview.hpp"

namespace debulk {

// Finds the pockets of a scan through regions of interest: a coarse pass (MeshPass) finds the elevations, and only
// windows round them are cleaned, gridded, filtered and segmented, with the same exact steps as the whole scan
// (FrontEnd, segment, find_feet). The prepared data and the buffers are kept from scan to scan. The memory of results
// that nobody holds any more when the next run begins is reused. A result that is still held is not changed.
//
// Near a pocket, out to its foot and a margin beyond, a window holds the same heights as the whole scan's height map,
// except that the outlier threshold is estimated from a sample (SampledThreshold). Outlier decisions in a window are
// exact for that threshold T: its image part reaches at least 4 T beyond the part that is used. So if one of a point's
// true nearest four neighbours lies outside, it is at least 4 T away and the mean distance is at least T: the point is
// removed whether that neighbour is seen or not. If a pocket or a foot reaches beyond the exact heights, the exact area
// grows.
//
// No elevation that covers AreaTol is missed, unless along every cord of the mesh that it crosses fewer than 8 of the
// 25 pixels round each of its pixels are higher than half the cut. Such an elevation is narrower than 2 pixels, and the
// filters of the whole scan remove it too; see Mesh and MeshPass.
class RegionFront {
 public:
  // seen: the heights that the reference was fitted to; null means that the reference is known everywhere.
  RegionFront(std::shared_ptr<const Reference> reference, const Eigen::Vector2d& low, const Eigen::Vector2d& high, const View& view,
              const RegionOptions& options, int threads = 0, const Grid<float>* seen = nullptr);

  // Whether any scan can be processed this way; if not, reason() says why.
  bool usable() const { return usable_; }
  // Returns false if the scan must be processed as a whole; reason() then says why. `masked`, if given, is nonzero
  // where a pixel is not to be used. Throws Stopped.
  bool run(const CloudView& scan, const std::uint8_t* masked, const Stop& stop = Stop());

  const std::string& reason() const { return reason_; }
  // The regions of the last run; a caller that holds one may keep it.
  const std::vector<std::shared_ptr<const Region>>& regions() const { return regions_; }
  const SampledThreshold& threshold() const { return threshold_; }
  const Mesh& mesh() const { return mesh_; }
  double flag_mm() const { return options_.flag_mm.value_or(options_.segment.cut_height_mm / 2); }
  double image_share() const { return image_share_; }  // share of the pixels that lie in windows
  double read_share() const { return read_share_; }    // share of the pixels that the coarse pass and the sample read
  // The heights at every `step`-th grid point: exact in the windows, cell means of the coarse pass elsewhere.
  Overview overview() const;
  const Grid<float>& frame() const { return frame_; }  // origin, spacing and size of the height map, without values
  struct Times {
    double sample = 0, coarse = 0, windows = 0, filter = 0, segment = 0, feet = 0;  // ms
  };
  const Times& times() const { return times_; }

 private:
  struct Scratch;
  struct Work;

  bool refuse(const char* why);
  bool run_coarse_pass(const CloudView& scan, const std::uint8_t* masked, Blocks& blocks, std::vector<Window>& windows, const Stop& stop);
  void lay_out(const std::vector<Window>& windows, const std::vector<std::uint8_t>& again);
  void retire(std::vector<std::unique_ptr<Work>>& works);
  bool process(const CloudView& scan, const std::uint8_t* masked, const Blocks& blocks, FootOptions& feet, const Stop& stop);
  void prepare_ply();
  void prepare_overview();
  CloudPart image_part(const Window& window, double threshold) const;
  void lay_coarse(Work& work) const;
  void take_over(Work& work, double margin) const;
  bool make_exact(const Window& strip, Work& work, const CloudView& scan, const std::uint8_t* masked, int threads, const Stop& stop);
  void filter(Work& work, int threads, const Stop& stop);
  void segment(Work& work, int threads, const Stop& stop);
  std::vector<Window> blocks_to_refine(const Work& work, const Blocks& blocks) const;
  void look_closer(const std::vector<Window>& windows, Blocks& blocks) const;
  void grow(Window& window, const std::vector<Window>& to_refine, Blocks& blocks) const;
  std::unique_ptr<Work> fresh_work(const Window& window);
  template <class Item, class Body>
  void largest_first(std::vector<Item>& items, const Body& body) const;

  std::shared_ptr<const Reference> reference_;
  View view_;
  RegionOptions options_;
  int threads_;
  Grid<float> frame_;
  ReferenceGaps gaps_;
  RayBase base_;
  std::optional<ImageGridding> gridding_;
  Mesh mesh_;
  Grid<std::uint8_t> on_ply_, near_ply_;  // coarse grids that mark the ply, and the ply with a margin round it
  std::vector<std::uint8_t> tile_near_;
  std::vector<TileSpan> spans_;  // the tiles near the ply, one span per row of tiles
  int overview_step_ = 1;
  Grid<std::int32_t> overview_cell_;  // index of the coarse pass's cell; -1: out of the camera's view, or no reference there
  Grid<std::uint8_t> overview_reference_;

  MeshPass pass_;
  ThresholdSampler sampler_;
  SampledThreshold threshold_;
  std::vector<std::shared_ptr<const Region>> regions_;
  std::vector<std::unique_ptr<Work>> works_;        // the works of the regions
  std::vector<std::unique_ptr<Work>> earlier_;      // works that larger ones have just replaced
  std::vector<std::unique_ptr<Work>> spare_works_;  // works whose memory may be reused
  Pool<Scratch> scratch_;
  bool usable_ = false;
  std::string reason_;
  double image_share_ = 0, read_share_ = 0;
  Times times_;

 public:
  ~RegionFront();
};

}  // namespace debulk
