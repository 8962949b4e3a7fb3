#include "debulk/region/region_work.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "debulk/cloud/transform.hpp"
#include "debulk/core/clock.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/row_runs.hpp"
#include "debulk/pocket/height_noise.hpp"
#include "debulk/surface/median.hpp"

namespace debulk {
namespace {

constexpr double smallest_mm = 10.0;  // extent of a scan; below it the unit is in doubt, and the whole scan is processed
constexpr int rounds = 5;             // most rounds in which windows grow

}  // namespace

RegionFront::~RegionFront() = default;

void RegionOptions::check() const {
  front.check();
  segment.check();
  feet.check();
  require(row_step >= 0 && column_step >= 0 && (row_step > 0) == (column_step > 0), "mesh", "two positive numbers of pixels, or none",
          std::to_string(row_step) + ", " + std::to_string(column_step));
  require(!flag_mm || (std::isfinite(*flag_mm) && *flag_mm > 0), "flag_mm", "a positive length in mm", flag_mm.value_or(0));
}

RegionFront::RegionFront(std::shared_ptr<const Reference> reference, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                         const View& view, const RegionOptions& options, int threads, const Grid<float>* seen)
    : reference_(std::move(reference)), view_(view), options_(options), threads_(threads) {
  options.check();
  transform(CloudView{}, view.mold_from_scanner);  // throws if the pose is not rigid
  require(view.width > 1 && view.height > 1, "shape", "an image of at least 2 by 2 pixels",
          std::to_string(view.height) + " by " + std::to_string(view.width));
  const Grid<double>& domain = reference_->heights();
  const Eigen::Vector2d last = domain.position(domain.nx - 1, domain.ny - 1);
  frame_ = covering_grid(low.cwiseMax(domain.origin), high.cwiseMin(last), options.front.spacing);
  if (seen) gaps_ = ReferenceGaps(*seen, frame_, options.front.fill.diameter);
  base_ = ray_base(*reference_, view_, threads);
  gridding_.emplace(*reference_, view_, frame_, threads);
  if (options_.segment.ply_outline) options_.segment.ply_outline = checked_polygon(*options_.segment.ply_outline, "ply_outline");
  options_.segment.blur_mm2 = gridding_->blur_mm2();
  prepare_ply();
  prepare_overview();
  frame_.values = {};
  if (!(options_.segment.area_tol_mm2 > 0))
    reason_ = "with an area tolerance of 0 nothing may be missed, however small";
  else if (!mesh_.exists())
    reason_ = "no mesh of pixels is fine enough for the area tolerance";
  else if (options_.front.outliers.neighbours != 4)
    reason_ = "only four neighbours are searched in the image";
  usable_ = reason_.empty();
}

bool RegionFront::refuse(const char* why) {
  reason_ = why;
  return false;
}

// Returns the blocks in which part of a pocket, of its foot or of another elevation lies on heights of the coarse pass,
// or at a side of the window beyond which the frame continues.
std::vector<Window> RegionFront::blocks_to_refine(const Work& work, const Blocks& blocks) const {
  constexpr int side = Blocks::side;
  const Window& w = work.window();
  const Segmentation& s = work.region->segmentation;
  const FootMap& feet = work.region->feet;
  bool open = false;
  for (const Pocket& p : s.pockets) open |= p.touches_unknown;
  for (const Foot& f : feet.feet) open |= !f.closed;
  const double least = std::min(feet.hill_mm, flag_mm());
  const auto stands = [&](int i, int j) { return s.heights.at(i, j) >= least && feet.heights.at(i, j) >= least; };
  const auto taken = [&](int i, int j) {
    return stands(i, j) || s.labels.at(i, j) > 0 || feet.labels.at(i, j) > 0 ||
           (open && std::isnan(s.heights.at(i, j)) && s.ply.on_ply(i, j));
  };
  std::vector<Window> out;
  const int nx = s.labels.nx, ny = s.labels.ny;
  for (int bj = 0; bj < ny; bj += side)
    for (int bi = 0; bi < nx; bi += side) {
      const Window block{bi, bj, std::min(bi + side, nx), std::min(bj + side, ny), 0};
      const bool coarse = !blocks.wanted((w.i0 + bi) / side, (w.j0 + bj) / side);
      const bool at_side =
          (bi == 0 && w.i0 > 0) || (bj == 0 && w.j0 > 0) || (block.i1 == nx && w.i1 < frame_.nx) || (block.j1 == ny && w.j1 < frame_.ny);
      if (!coarse && !at_side) continue;
      bool found = false;
      for (int j = block.j0; j < block.j1 && !found; ++j)
        for (int i = block.i0; i < block.i1 && !found; ++i) {
          const bool edge =
              (i == 0 && w.i0 > 0) || (j == 0 && w.j0 > 0) || (i == nx - 1 && w.i1 < frame_.nx) || (j == ny - 1 && w.j1 < frame_.ny);
          found = (coarse || edge) && taken(i, j);
        }
      if (found) out.push_back({w.i0 + block.i0, w.j0 + block.j0, w.i0 + block.i1, w.j0 + block.j1, w.top});
    }
  return out;
}

// Marks the blocks to refine, and those round them, as to be exact, and enlarges the window to hold them.
void RegionFront::grow(Window& window, const std::vector<Window>& to_refine, Blocks& blocks) const {
  for (const Window& block : to_refine) {
    const Window ring = grown(block, 2 * Blocks::side, frame_.nx, frame_.ny);
    blocks.add(ring, window.top);
    window = {std::min(window.i0, ring.i0), std::min(window.j0, ring.j0), std::max(window.i1, ring.i1), std::max(window.j1, ring.j1),
              window.top};
  }
}

// Processes each item by one thread, the largest first; an item larger than a thread's share is processed by all
// threads.
template <class Item, class Body>
void RegionFront::largest_first(std::vector<Item>& items, const Body& body) const {
  std::stable_sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.size() > b.size(); });
  const int threads = threads_ == 0 ? default_threads() : threads_;
  long left = 0;
  for (const Item& item : items) left += item.size();
  std::size_t alone = 0;
  for (; threads > 1 && alone < items.size() && items[alone].size() * threads > left; ++alone) {
    left -= items[alone].size();
    body(items[alone], threads_);
  }
  parallel_for(static_cast<long>(items.size() - alone), 1, threads_,
               [&](long begin, long) { body(items[alone + static_cast<std::size_t>(begin)], 1); });
}

// Finds the elevations: sets threshold_ and pass_, and lays windows and blocks round them. Returns false if the scan is
// refused.
bool RegionFront::run_coarse_pass(const CloudView& scan, const std::uint8_t* masked, Blocks& blocks, std::vector<Window>& windows,
                                  const Stop& stop) {
  Clock laps;
  threshold_ = sampler_.run(scan, masked, view_.camera, options_.front.outliers, threads_, stop);
  times_.sample = laps.lap();
  if (!threshold_.pinhole) return refuse("the scan is not an image of the camera, or shows little");
  MeshOptions mesh;
  mesh.high_mm = flag_mm();
  mesh.clamp_mm = options_.segment.cut_height_mm;
  mesh.reach_mm = 1.5 * threshold_.value;
  pass_.run(scan, masked, view_, mesh_, base_, mesh, options_.segment.ply_outline ? &near_ply_ : nullptr, spans_, threads_, stop);
  if (!(pass_.across_mm() >= smallest_mm)) return refuse("the scan shows little");
  if (pass_.strays() > 0) return refuse("the scan is not an image of the camera");
  read_share_ = static_cast<double>(pass_.read() + threshold_.points) / static_cast<double>(scan.size());
  WindowOptions around;
  around.low_mm = options_.feet.thickness_mm + options_.feet.mold_tol_mm / 2;
  windows = find_windows(pass_, mesh_, base_, view_, tile_near_, frame_, around, blocks);
  look_closer(windows, blocks);
  times_.coarse = laps.lap();
  return true;
}

// Puts works_ in the windows' order. A work that exists already is kept, unless `again` is set for it.
void RegionFront::lay_out(const std::vector<Window>& windows, const std::vector<std::uint8_t>& again) {
  std::vector<std::unique_ptr<Work>> old = std::move(works_);
  works_.clear();
  retire(earlier_);
  for (std::size_t k = 0; k < windows.size(); ++k) {
    const auto same = std::find_if(old.begin(), old.end(), [&](const auto& w) { return w && w->window() == windows[k]; });
    works_.push_back(same != old.end() && !again[k] ? std::move(*same) : fresh_work(windows[k]));
  }
  for (std::unique_ptr<Work>& work : old)
    if (work) earlier_.push_back(std::move(work));
}

void RegionFront::retire(std::vector<std::unique_ptr<Work>>& works) {
  for (std::unique_ptr<Work>& work : works) spare_works_.push_back(std::move(work));
  works.clear();
}

// Processes the windows that are not done, from the scan to pockets and feet. Returns false if the scan is refused.
bool RegionFront::process(const CloudView& scan, const std::uint8_t* masked, const Blocks& blocks, FootOptions& feet, const Stop& stop) {
  struct Part {
    Window window;
    Work* work;
    long size() const { return window.size(); }
  };
  struct Job {
    Work* work;
    long size() const { return work->window().size(); }
  };
  const double margin = (4 * threshold_.value + 11 * mesh_.pixel_mm) / frame_.spacing;  // about the margin of image_part()
  std::vector<Part> parts;
  std::vector<Job> jobs;
  image_share_ = 0;
  for (const auto& work : works_) {
    if (!work->done) jobs.push_back({work.get()});
    for (const Window& window : blocks.rectangles(work->window(), margin)) {
      const CloudPart part = image_part(window, threshold_.value);
      image_share_ += static_cast<double>(part.width) * part.height / static_cast<double>(scan.size());
      if (!work->done) work->exact.push_back(window);
    }
  }
  const bool first = jobs.size() == works_.size();  // later rounds only add to what was paid for already
  if (first && image_share_ > options_.largest_share) return refuse("what stands up covers most of the scan");

  Clock laps;
  std::atomic<bool> fits{true};
  largest_first(jobs, [&](Job& job, int) {
    lay_coarse(*job.work);
    take_over(*job.work, margin);
  });
  for (const Job& job : jobs)
    for (const Window& window : job.work->to_make) parts.push_back({window, job.work});
  largest_first(parts, [&](Part& part, int threads) {
    if (!make_exact(part.window, *part.work, scan, masked, threads, stop)) fits = false;
  });
  if (!fits) return refuse("the scan is not an image of the camera");
  times_.windows += laps.lap();
  largest_first(jobs, [&](Job& job, int threads) { filter(*job.work, threads, stop); });
  times_.filter += laps.lap();
  largest_first(jobs, [&](Job& job, int threads) { segment(*job.work, threads, stop); });
  times_.segment += laps.lap();
  if (!feet.noise_mm) {  // estimated only once: windows that grow add no new information
    std::vector<GridPart> exact;
    for (const Part& p : parts) {
      const Window &w = p.work->window(), &e = p.window;
      exact.push_back({&p.work->region->segmentation.heights, e.i0 - w.i0, e.j0 - w.j0, e.i1 - w.i0, e.j1 - w.j0});
    }
    const double noise = height_noise(exact);
    feet.noise_mm = std::isnan(noise) ? 0 : noise;
  }
  largest_first(jobs, [&](Job& job, int threads) {
    job.work->region->feet = find_feet(job.work->region->segmentation, feet, threads, stop);
    job.work->to_refine = blocks_to_refine(*job.work, blocks);
    job.work->done = true;
  });
  times_.feet += laps.lap();
  return true;
}

bool RegionFront::run(const CloudView& scan, const std::uint8_t* masked, const Stop& stop) {
  times_ = {};
  regions_.clear();
  retire(works_), retire(earlier_);
  if (!usable_) return false;
  if (scan.width != view_.width || scan.height != view_.height) return refuse("the scan has another shape than the reference");
  Blocks blocks(frame_);
  std::vector<Window> windows;
  if (!run_coarse_pass(scan, masked, blocks, windows, stop)) return false;
  FootOptions feet = options_.feet;
  std::vector<std::uint8_t> again(windows.size(), 0);
  for (int round = 0;; ++round) {
    lay_out(windows, again);
    if (!process(scan, masked, blocks, feet, stop)) return false;
    const auto sure = [](const auto& work) { return work->to_refine.empty(); };
    if (std::all_of(works_.begin(), works_.end(), sure)) break;
    if (round + 1 == rounds) return refuse("a pocket's foot runs on and on");
    std::vector<Window> wider = windows;
    for (std::size_t k = 0; k < works_.size(); ++k) grow(wider[k], works_[k]->to_refine, blocks);
    windows = merged(wider);
    again.assign(windows.size(), 0);
    for (std::size_t k = 0; k < windows.size(); ++k)
      for (std::size_t o = 0; o < works_.size(); ++o) again[k] |= !sure(works_[o]) && windows[k].overlaps(wider[o]);
  }
  for (const auto& work : works_) regions_.push_back(work->region);
  reason_.clear();
  return true;
}

}  // namespace debulk
