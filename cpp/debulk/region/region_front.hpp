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

// From a scan to its pockets through regions of interest: a coarse pass (MeshPass) finds what stands up, and only windows
// round that are cleaned, gridded, filtered and segmented, with the same exact steps as the whole scan (FrontEnd, segment,
// find_feet). What is prepared, and the buffers, stay from scan to scan. So does the memory of results that are held by nobody any
// more when the next run begins. A result that is still held stays as it is.
//
// Near a pocket, out to its foot and a margin beyond, a window holds what the whole scan's height map holds there, but for the outlier
// threshold, which is estimated from a sample (SampledThreshold). Outlier decisions in a window are exact for that threshold T: its image
// part reaches at least 4 T beyond what is used, so a point with one of its true nearest four outside has that one at 4 T or more, a mean
// of T or more, and goes with or without it. A pocket or a foot that reaches beyond the exact heights makes them grow.
//
// What is missed: nothing that covers AreaTol, unless along every cord of the mesh that it crosses less than 8 of 25 pixels
// round each of its pixels stand higher than half the cut (narrower than 2 pixels: the filters of the whole scan leave
// nothing of that), see Mesh and MeshPass.
class RegionFront {
 public:
  // seen: what the reference was fitted to; null: it is known everywhere.
  RegionFront(std::shared_ptr<const Reference> reference, const Eigen::Vector2d& low, const Eigen::Vector2d& high, const View& view,
              const RegionOptions& options, int threads = 0, const Grid<float>* seen = nullptr);

  // Whether scans can be taken at all; if not, reason() says why.
  bool usable() const { return usable_; }
  // False: the scan is to be processed whole; reason() says why. `masked`, if given, is nonzero where a pixel is not to be
  // used. Throws Stopped.
  bool run(const CloudView& scan, const std::uint8_t* masked, const Stop& stop = Stop());

  const std::string& reason() const { return reason_; }
  // Of the last run; each is its holders' to keep.
  const std::vector<std::shared_ptr<const Region>>& regions() const { return regions_; }
  const SampledThreshold& threshold() const { return threshold_; }
  const Mesh& mesh() const { return mesh_; }
  double flag_mm() const { return options_.flag_mm.value_or(options_.segment.cut_height_mm / 2); }
  double image_share() const { return image_share_; }  // of the pixels, in windows
  double read_share() const { return read_share_; }    // of the pixels, read by the coarse pass and the sample
  // Every `step`-th grid point: exact in the windows, cell means of the coarse pass elsewhere.
  Overview overview() const;
  const Grid<float>& frame() const { return frame_; }  // without values
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
  Grid<std::uint8_t> on_ply_, near_ply_;  // coarse: the ply, and a little round it
  std::vector<std::uint8_t> tile_near_;
  std::vector<TileSpan> spans_;  // of the tiles that are near the ply
  int overview_step_ = 1;
  Grid<std::int32_t> overview_cell_;  // of the coarse pass; -1: out of the camera's view, or no reference is known there
  Grid<std::uint8_t> overview_reference_;

  MeshPass pass_;
  ThresholdSampler sampler_;
  SampledThreshold threshold_;
  std::vector<std::shared_ptr<const Region>> regions_;
  std::vector<std::unique_ptr<Work>> works_;        // of the regions
  std::vector<std::unique_ptr<Work>> earlier_;      // that larger ones have just replaced
  std::vector<std::unique_ptr<Work>> spare_works_;  // whose memory may be used
  Pool<Scratch> scratch_;
  bool usable_ = false;
  std::string reason_;
  double image_share_ = 0, read_share_ = 0;
  Times times_;

 public:
  ~RegionFront();
};

}  // namespace debulk
