#include "debulk/pocket/region_front.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>

#include "debulk/cloud/transform.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/runs.hpp"
#include "debulk/pocket/smooth.hpp"
#include "debulk/surface/median.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double ply_cell_mm = 2.0;
constexpr double beside_mm = 6.0;     // a high point so far off the ply still matters
constexpr double stands_mm = 30.0;    // and what stands up so far off
constexpr double above_mm = 2.0;      // what a window's image part leaves for heights below 0 and above the top
constexpr double overview_mm = 2.0;   // spacing, about
constexpr double smallest_mm = 10.0;  // a scan; else its unit is in doubt, and the whole is looked at
constexpr int rounds = 5;             // of windows growing
constexpr double depth_slack = 60.0;  // mm above the reference, for the image part of a window

class Laps {
 public:
  double lap() {
#ifdef DEBULK_CPU_LAPS
    const std::clock_t c = std::clock();
    const double p = 1e3 * static_cast<double>(c - c_) / CLOCKS_PER_SEC;
    c_ = c;
    return p;
#endif
    const auto now = std::chrono::steady_clock::now();
    const double passed = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return passed;
  }

 private:
#ifdef DEBULK_CPU_LAPS
  std::clock_t c_ = std::clock();
#endif
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Everything within `reach` cells, along x and y each, of a marked cell.
Grid<std::uint8_t> widened(const Grid<std::uint8_t>& marked, int reach) {
  auto rows = marked, out = marked;
  for (int j = 0; j < marked.ny; ++j)
    for (int i = 0; i < marked.nx; ++i)
      for (int k = std::max(0, i - reach); k <= std::min(marked.nx - 1, i + reach) && !rows.at(i, j); ++k) rows.at(i, j) = marked.at(k, j);
  out = rows;
  for (int j = 0; j < marked.ny; ++j)
    for (int i = 0; i < marked.nx; ++i)
      for (int k = std::max(0, j - reach); k <= std::min(marked.ny - 1, j + reach) && !out.at(i, j); ++k) out.at(i, j) = rows.at(i, k);
  return out;
}

bool marked_at(const Grid<std::uint8_t>& grid, const Eigen::Vector2d& xy) {
  if (!xy.allFinite()) return false;
  const Eigen::Vector2d cell = grid.locate(xy);
  if (!(cell.cwiseAbs().maxCoeff() < 1e6)) return false;
  const int i = static_cast<int>(std::lround(cell.x())), j = static_cast<int>(std::lround(cell.y()));
  return grid.contains(i, j) && grid.at(i, j) != 0;
}

// The reference under a pixel, mold XY; NaN outside it.
Eigen::Vector2d under(const RayBase& base, const View& view, double column, double row) {
  const double u = std::clamp(column / base.step, 0.0, base.nx - 1.001), v = std::clamp(row / base.step, 0.0, base.ny - 1.001);
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(base.nx) + static_cast<std::size_t>(i);
  const std::size_t below = at + static_cast<std::size_t>(base.nx);
  const double s = u - i, t = v - j;
  const double depth =
      (1 - t) * ((1 - s) * base.depth[at] + s * base.depth[at + 1]) + t * ((1 - s) * base.depth[below] + s * base.depth[below + 1]);
  const Eigen::Vector3d ray(view.camera.u(column), view.camera.v(row), 1);
  return (depth * (view.rotation() * ray) + view.centre()).head<2>();
}

}  // namespace

// What a thread needs for one window.
struct RegionFront::Scratch {
  CloudPart part;
  PinholeOutliers image;
  RayBase base;
  Grid<float> other;
  HoleFilling filling;
};

struct RegionFront::Work {
  Window window;
  HeightMap map;
  std::optional<Segmentation> segmentation;
  std::optional<FootMap> feet;
};

RegionFront::~RegionFront() = default;

void RegionOptions::check() const {
  front.check();
  segment.check();
  feet.check();
}

RegionFront::RegionFront(std::shared_ptr<const Reference> reference, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                         const View& view, const RegionOptions& options, int threads)
    : reference_(std::move(reference)), view_(view), options_(options), threads_(threads) {
  options.check();
  transform(CloudView{}, view.mold_from_scanner);  // is it rigid?
  require(view.width > 1 && view.height > 1, "shape", "an image of at least 2 by 2 pixels",
          std::to_string(view.height) + " by " + std::to_string(view.width));
  const Grid<double>& domain = reference_->heights();
  const Eigen::Vector2d last = domain.position(domain.nx - 1, domain.ny - 1);
  frame_ = covering_grid(low.cwiseMax(domain.origin), high.cwiseMin(last), options.front.spacing);
  base_ = ray_base(*reference_, view_, threads);
  gridding_.emplace(*reference_, view_, frame_, threads);
  if (options_.segment.ply_outline) options_.segment.ply_outline = checked_polygon(*options_.segment.ply_outline, "ply_outline");
  prepare_ply();
  prepare_overview();
  frame_.values = {};
}

void RegionFront::prepare_ply() {
  const int nx = static_cast<int>(frame_.nx * frame_.spacing / ply_cell_mm) + 2, ny = static_cast<int>(frame_.ny * frame_.spacing / ply_cell_mm) + 2;
  on_ply_ = Grid<std::uint8_t>(nx, ny, frame_.origin, ply_cell_mm, 1);
  if (options_.segment.ply_outline) {
    const PlyMask ply(*options_.segment.ply_outline, on_ply_);
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) on_ply_.at(i, j) = ply.on_ply(i, j);
  }
  mesh_ = choose_mesh(base_, view_, options_.segment.area_tol_mm2, options_.segment.ply_outline ? &on_ply_ : nullptr);
  near_ply_ = widened(on_ply_, static_cast<int>(std::ceil(beside_mm / ply_cell_mm)));
  const Grid<std::uint8_t> far = widened(on_ply_, static_cast<int>(std::ceil(stands_mm / ply_cell_mm)));

  // How much of the ply the camera can see.
  const Eigen::Matrix3d to_scanner = view_.rotation().transpose();
  long on = 0, visible = 0;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      if (!on_ply_.at(i, j)) continue;
      ++on;
      const Eigen::Vector2d xy = on_ply_.position(i, j);
      if (!reference_->inside(xy)) continue;
      const Eigen::Vector3d p = to_scanner * (Eigen::Vector3d(xy.x(), xy.y(), reference_->height(xy)) - view_.centre());
      const double column = view_.camera.cx + p.x() / p.z() * view_.camera.f, row = view_.camera.cy + p.y() / p.z() * view_.camera.f;
      visible += p.z() > 0 && column >= 1 && row >= 1 && column <= view_.width - 2 && row <= view_.height - 2;
    }
  const double cell = ply_cell_mm * ply_cell_mm;
  visible_mm2_ = options_.segment.ply_outline && on > 0
                     ? std::abs(polygon_area(*options_.segment.ply_outline)) * static_cast<double>(visible) / static_cast<double>(on)
                     : static_cast<double>(visible) * cell;

  constexpr int side = MeshPass::tile_side;
  const int tiles_x = (view_.width + side - 1) / side, tiles_y = (view_.height + side - 1) / side;
  for (int j = 0; j < tiles_y; ++j)
    for (int i = 0; i < tiles_x; ++i) tile_near_.push_back(marked_at(far, under(base_, view_, (i + 0.5) * side, (j + 0.5) * side)));
  if (!mesh_.exists()) return;
  constexpr int across = MeshPass::cell_columns;
  const int cells_x = (view_.width + across - 1) / across, cells_y = (view_.height + mesh_.row_step - 1) / mesh_.row_step;
  cell_mm2_.reserve(static_cast<std::size_t>(cells_x) * static_cast<std::size_t>(cells_y));
  for (int j = 0; j < cells_y; ++j)
    for (int i = 0; i < cells_x; ++i) {
      const double column = (i + 0.5) * across, row = (j + 0.5) * mesh_.row_step, d = 1;
      const Eigen::Vector2d xy = under(base_, view_, column, row);
      float area = 0;
      if (marked_at(on_ply_, xy)) {
        const Eigen::Vector2d a = under(base_, view_, column + d, row) - xy, b = under(base_, view_, column, row + d) - xy;
        const double pixel = std::abs(a.x() * b.y() - a.y() * b.x());
        area = static_cast<float>((std::isfinite(pixel) ? pixel : mesh_.pixel_mm2) * across * mesh_.row_step);
      }
      cell_mm2_.push_back(area);
    }
}

void RegionFront::prepare_overview() {
  overview_step_ = std::max(1, static_cast<int>(std::lround(overview_mm / frame_.spacing)));
  const int step = overview_step_;
  overview_cell_ = Grid<std::int32_t>((frame_.nx - 1) / step + 1, (frame_.ny - 1) / step + 1, frame_.origin, step * frame_.spacing, -1);
  if (!mesh_.exists()) return;
  const Eigen::Matrix3d to_scanner = view_.rotation().transpose();
  constexpr int side = MeshPass::tile_side, across = MeshPass::cell_columns;
  const int pitch = (view_.width + side - 1) / side * (side / across);
  for (int j = 0; j < overview_cell_.ny; ++j)
    for (int i = 0; i < overview_cell_.nx; ++i) {
      const Eigen::Vector2d xy = overview_cell_.position(i, j);
      const Eigen::Vector3d p = to_scanner * (Eigen::Vector3d(xy.x(), xy.y(), reference_->height(xy)) - view_.centre());
      const double column = view_.camera.cx + p.x() / p.z() * view_.camera.f, row = view_.camera.cy + p.y() / p.z() * view_.camera.f;
      if (!(p.z() > 0 && column >= 0 && row >= 0 && column <= view_.width - 1 && row <= view_.height - 1)) continue;
      overview_cell_.at(i, j) = static_cast<int>(row) / mesh_.row_step * pitch + static_cast<int>(column) / across;
    }
}

bool RegionFront::refuse(const char* why) {
  reason_ = why;
  regions_.clear(), maps_.clear();
  return false;
}

// Every pixel that the window's points may be looked up at, and the margin of the exact outlier decisions.
CloudPart RegionFront::image_part(const Window& window, double threshold) const {
  const Eigen::Matrix3d to_scanner = view_.rotation().transpose();
  double left = view_.width, right = 0, top = view_.height, bottom = 0, nearest = std::numeric_limits<double>::infinity();
  constexpr int stride = 32;
  for (int j = window.j0;; j = std::min(j + stride, window.j1 - 1)) {
    for (int i = window.i0;; i = std::min(i + stride, window.i1 - 1)) {
      const Eigen::Vector2d xy = frame_.position(i, j);
      const double f = reference_->height(xy);
      for (const double height : {-above_mm, window.top + above_mm}) {
        const Eigen::Vector3d p = to_scanner * (Eigen::Vector3d(xy.x(), xy.y(), f + height) - view_.centre());
        const double column = view_.camera.cx + p.x() / p.z() * view_.camera.f, row = view_.camera.cy + p.y() / p.z() * view_.camera.f;
        left = std::min(left, column), right = std::max(right, column), top = std::min(top, row), bottom = std::max(bottom, row);
        nearest = std::min(nearest, p.z());
      }
      if (i == window.i1 - 1) break;
    }
    if (j == window.j1 - 1) break;
  }
  const double u = std::max(std::abs(view_.camera.u(0)), std::abs(view_.camera.u(view_.width)));
  const double v = std::max(std::abs(view_.camera.v(0)), std::abs(view_.camera.v(view_.height)));
  const double stretch = std::sqrt(1 + std::max(u, v) * std::max(u, v));
  const double reach = 4 * threshold * view_.camera.f * stretch / std::max(1.0, nearest - depth_slack) + 1;  // pixels
  const int margin = static_cast<int>(std::ceil(std::min(reach, 1e5))) + 3;
  CloudPart part;
  const int first = std::clamp(static_cast<int>(std::floor(left)) - margin, 0, view_.width - 1) / 16 * 16;
  part.column = first;
  part.row = std::clamp(static_cast<int>(std::floor(top)) - margin, 0, view_.height - 1) / 16 * 16;
  part.width = std::clamp(static_cast<int>(std::ceil(right)) + margin + 1, part.column + 1, view_.width) - part.column;
  part.height = std::clamp(static_cast<int>(std::ceil(bottom)) + margin + 1, part.row + 1, view_.height) - part.row;
  part.width = std::max(part.width, std::min(16, view_.width - part.column));
  part.height = std::max(part.height, 2);
  part.row = std::min(part.row, (view_.height - part.height) / 16 * 16);
  return part;
}

std::unique_ptr<RegionFront::Scratch> RegionFront::borrow() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (spare_.empty()) return std::make_unique<Scratch>();
  std::unique_ptr<Scratch> out = std::move(spare_.back());
  spare_.pop_back();
  return out;
}

void RegionFront::give_back(std::unique_ptr<Scratch> scratch) {
  const std::lock_guard<std::mutex> lock(mutex_);
  spare_.push_back(std::move(scratch));
}

// The window's heights as the coarse pass has them.
void RegionFront::lay_coarse(Work& work) const {
  const Window& w = work.window;
  Grid<float>& heights = work.map.heights;
  heights.nx = w.i1 - w.i0, heights.ny = w.j1 - w.j0, heights.spacing = frame_.spacing, heights.origin = frame_.position(w.i0, w.j0);
  heights.values.resize(static_cast<std::size_t>(heights.nx) * static_cast<std::size_t>(heights.ny));
  const std::vector<float>& cells = pass_.cell_height();
  const int step = overview_step_;
  for (int j = 0; j < heights.ny; ++j) {
    float* row = &heights.at(0, j);
    if (j > 0 && (j + w.j0) % step != 0) {
      std::copy_n(row - heights.nx, heights.nx, row);
      continue;
    }
    for (int i = 0; i < heights.nx; ++i) {
      const int cell = overview_cell_.at((i + w.i0) / step, (j + w.j0) / step);
      row[i] = cell >= 0 ? cells[static_cast<std::size_t>(cell)] : nan;
    }
  }
}

// False: not the camera's.
bool RegionFront::make_exact(const Window& strip, Work& work, const CloudView& scan, const std::uint8_t* masked, int threads,
                             const Stop& stop) {
  if (stop.now()) throw Stopped("a region's height map was stopped");
  std::unique_ptr<Scratch> scratch = borrow();
  const CloudPart wanted = image_part(strip, threshold_.value);
  CloudPart& part = scratch->part;
  part.column = wanted.column, part.row = wanted.row, part.width = wanted.width, part.height = wanted.height;
  part.copy(scan, masked);

  RayBase& base = scratch->base;
  base.step = base_.step;
  base.nx = (part.width - 1) / base.step + 2, base.ny = (part.height - 1) / base.step + 2;
  base.depth.assign(static_cast<std::size_t>(base.nx) * static_cast<std::size_t>(base.ny), nan);
  base.gain = base.depth;
  for (int j = 0; j < base.ny; ++j) {
    const int row = part.row / base.step + j, column = part.column / base.step, count = std::min(base.nx, base_.nx - column);
    if (row >= base_.ny) continue;
    const auto from = static_cast<long>(row) * base_.nx + column, to = static_cast<long>(j) * base.nx;
    std::copy_n(base_.depth.begin() + from, count, base.depth.begin() + to);
    std::copy_n(base_.gain.begin() + from, count, base.gain.begin() + to);
  }
  PinholeOutliers& image = scratch->image;
  image.fixed = threshold_.value;
  image.tolerance = 0.01;
  const bool fits = image.run(part.view(), part.camera(view_.camera), options_.front.outliers, &base, threads, stop);
  if (fits) {
    Grid<float>& exact = scratch->other;
    exact.nx = strip.i1 - strip.i0, exact.ny = strip.j1 - strip.j0, exact.spacing = frame_.spacing;
    exact.values.resize(static_cast<std::size_t>(exact.nx) * static_cast<std::size_t>(exact.ny));
    gridding_->run(image, {part.column, part.row, part.width, part.height}, exact, strip.i0, strip.j0, image.isa, threads, stop);
    for (int j = 0; j < exact.ny; ++j)
      std::copy_n(&exact.at(0, j), exact.nx, &work.map.heights.at(strip.i0 - work.window.i0, strip.j0 - work.window.j0 + j));
  }
  give_back(std::move(scratch));
  return fits;
}

void RegionFront::filter(Work& work, int threads, const Stop& stop) {
  const auto check = [&] {
    if (stop.now()) throw Stopped("a region's height map was stopped");
  };
  std::unique_ptr<Scratch> scratch = borrow();
  Grid<float>& heights = work.map.heights;
  check();
  scratch->filling.run(heights, options_.front.fill, work.map.measured, threads, stop);
  if (options_.front.spike > 0) {
    without_spikes(heights, options_.front.spike, scratch->other, threads, stop);
    heights.values.swap(scratch->other.values);
  }
  if (options_.front.median > 1) {
    median(heights, options_.front.median, scratch->other, threads, stop);
    heights.values.swap(scratch->other.values);
  }
  give_back(std::move(scratch));
}

// Whether something of a pocket or its foot lies on heights of the coarse pass, or at a side of the window behind which the
// frame goes on: then more blocks are to be exact, and the window is to hold them.
bool RegionFront::wants_more(const Work& work, Blocks& blocks, Window& window) const {
  constexpr int side = Blocks::side;
  const Window& w = work.window;
  const Segmentation& s = *work.segmentation;
  bool open = false;
  for (const Pocket& p : s.pockets) open |= p.touches_unknown;
  for (const Foot& f : work.feet->feet) open |= !f.closed;
  const auto taken = [&](int i, int j) {
    return s.labels.at(i, j) > 0 || work.feet->labels.at(i, j) > 0 ||
           (open && std::isnan(s.heights.at(i, j)) && s.ply.on_ply(i, j));
  };
  std::vector<Window> more;
  const int nx = s.labels.nx, ny = s.labels.ny;
  for (int bj = 0; bj < ny; bj += side)
    for (int bi = 0; bi < nx; bi += side) {
      const Window block{bi, bj, std::min(bi + side, nx), std::min(bj + side, ny), work.window.top};
      const bool coarse = !blocks.wanted((w.i0 + bi) / side, (w.j0 + bj) / side);
      const bool at_side = (bi == 0 && w.i0 > 0) || (bj == 0 && w.j0 > 0) || (block.i1 == nx && w.i1 < frame_.nx) ||
                           (block.j1 == ny && w.j1 < frame_.ny);
      if (!coarse && !at_side) continue;
      bool found = false;
      for (int j = block.j0; j < block.j1 && !found; ++j)
        for (int i = block.i0; i < block.i1 && !found; ++i) {
          const bool edge = (i == 0 && w.i0 > 0) || (j == 0 && w.j0 > 0) || (i == nx - 1 && w.i1 < frame_.nx) || (j == ny - 1 && w.j1 < frame_.ny);
          found = (coarse || edge) && taken(i, j);
        }
      if (found) more.push_back(block);
    }
  for (const Window& block : more) {
    const Window ring =
        grown({w.i0 + block.i0, w.j0 + block.j0, w.i0 + block.i1, w.j0 + block.j1, w.top}, 2 * side, frame_.nx, frame_.ny);
    blocks.add(ring, w.top);
    window = {std::min(window.i0, ring.i0), std::min(window.j0, ring.j0), std::max(window.i1, ring.i1), std::max(window.j1, ring.j1),
              window.top};
  }
  return !more.empty();
}

// Each item by one thread, the largest first; one that is larger than a thread's share by all of them.
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

bool RegionFront::run(const CloudView& scan, const std::uint8_t* masked, const Stop& stop) {
  times_ = {};
  Laps laps;
  if (!mesh_.exists()) return refuse("no mesh of pixels is fine enough for the area tolerance");
  if (options_.front.outliers.neighbours != 4) return refuse("only four neighbours are searched in the image");
  if (scan.width != view_.width || scan.height != view_.height) return refuse("the scan has another shape than the reference");
  threshold_ = sample_threshold(scan, masked, view_.camera, options_.front.outliers, threads_, stop);
  times_.sample = laps.lap();
  if (!threshold_.pinhole) return refuse("the scan is not an image of the camera, or shows little");

  MeshOptions mesh;
  mesh.high_mm = flag_mm();
  mesh.clamp_mm = options_.segment.cut_height_mm;
  mesh.reach_mm = 1.5 * threshold_.value;
  pass_.run(scan, masked, view_, mesh_, base_, mesh, options_.segment.ply_outline ? &near_ply_ : nullptr, threads_, stop);
  if (!(pass_.across_mm() >= smallest_mm)) return refuse("the scan shows little");
  if (pass_.strays() > 0) return refuse("the scan is not an image of the camera");
  read_share_ = static_cast<double>(pass_.read() + threshold_.points) / static_cast<double>(scan.size());
  account_for_holes();
  WindowOptions around;
  around.low_mm = options_.feet.thickness_mm + options_.feet.mold_tol_mm / 2;
  Blocks blocks(frame_);
  std::vector<Window> windows = find_windows(pass_, mesh_, base_, view_, tile_near_, frame_, around, blocks);
  times_.coarse = laps.lap();

  struct Strip {
    Window window;
    Work* work;
    long size() const { return window.size(); }
  };
  struct Job {
    Work* work;
    long size() const { return work->window.size(); }
  };
  std::vector<std::unique_ptr<Work>> works;
  FootOptions feet = options_.feet;
  std::vector<std::uint8_t> again(windows.size(), 1);  // windows to be made
  for (int round = 0;; ++round) {
    std::vector<std::unique_ptr<Work>> next;
    std::vector<Job> jobs;
    for (std::size_t k = 0; k < windows.size(); ++k) {
      const auto same = std::find_if(works.begin(), works.end(), [&](const auto& old) { return old && old->window == windows[k]; });
      if (same != works.end() && !again[k]) {
        next.push_back(std::move(*same));
        continue;
      }
      next.push_back(std::make_unique<Work>());
      next.back()->window = windows[k];
      jobs.push_back({next.back().get()});
    }
    works = std::move(next);
    std::vector<Strip> strips;
    image_share_ = 0;
    for (const auto& work : works)
      for (const Window& strip : blocks.strips(work->window)) {
        const CloudPart part = image_part(strip, threshold_.value);
        image_share_ += static_cast<double>(part.width) * part.height / static_cast<double>(scan.size());
        if (!work->segmentation) strips.push_back({strip, work.get()});
      }
    if (image_share_ > options_.largest_share) return refuse("what stands up covers most of the scan");

    laps.lap();
    std::atomic<bool> fits{true};
    largest_first(jobs, [&](Job& job, int) { lay_coarse(*job.work); });
    largest_first(strips, [&](Strip& strip, int threads) {
      if (!make_exact(strip.window, *strip.work, scan, masked, threads, stop)) fits = false;
    });
    if (!fits) return refuse("the scan is not an image of the camera");
    times_.windows += laps.lap();
    largest_first(jobs, [&](Job& job, int threads) { filter(*job.work, threads, stop); });
    times_.filter += laps.lap();
    largest_first(jobs, [&](Job& job, int) {
      if (stop.now()) throw Stopped("the segmentation was stopped");
      job.work->segmentation = segment(job.work->map.heights, options_.segment, &job.work->map.measured);
    });
    times_.segment += laps.lap();
    if (!feet.noise_mm) {  // once: windows that grow tell nothing new
      std::vector<GridPart> parts;
      for (const Strip& s : strips) {
        const Window& w = s.work->window;
        parts.push_back({&s.work->segmentation->heights, s.window.i0 - w.i0, s.window.j0 - w.j0, s.window.i1 - w.i0, s.window.j1 - w.j0});
      }
      const double noise = height_noise(parts);
      feet.noise_mm = std::isnan(noise) ? 0 : noise;
    }
    largest_first(jobs, [&](Job& job, int) {
      if (stop.now()) throw Stopped("the search for feet was stopped");
      job.work->feet = find_feet(*job.work->segmentation, feet);
    });
    times_.feet += laps.lap();

    bool grew = false;
    again.assign(windows.size(), 0);
    std::vector<Window> wider = windows;
    for (std::size_t k = 0; k < works.size(); ++k)
      if (wants_more(*works[k], blocks, wider[k])) again[k] = 1, grew = true;
    if (!grew) break;
    if (round + 1 == rounds) return refuse("a pocket's foot runs on and on");
    const std::vector<Window> old = std::move(windows);
    windows = merged(wider);
    std::vector<std::uint8_t> anew(windows.size(), 0);
    for (std::size_t k = 0; k < windows.size(); ++k)
      for (std::size_t o = 0; o < old.size(); ++o) anew[k] |= again[o] && windows[k].overlaps(wider[o]);
    again = std::move(anew);
  }
  regions_.clear(), maps_.clear();
  for (auto& work : works) {
    regions_.push_back({work->window, std::move(*work->segmentation), std::move(*work->feet)});
    maps_.push_back(std::move(work->map));
  }
  reason_.clear();
  return true;
}

// Area of the ply that is known: what the camera can see of it, less the holes that would not be filled.
void RegionFront::account_for_holes() {
  Grid<std::uint8_t> known(pass_.cells_x(), pass_.cells_y(), Eigen::Vector2d::Zero(), 1);
  for (int j = 0; j < known.ny; ++j) {
    const float* row = &pass_.cell_height()[static_cast<std::size_t>(j) * static_cast<std::size_t>(pass_.cell_pitch())];
    for (int i = 0; i < known.nx; ++i) known.at(i, j) = row[i] == row[i];
  }
  const std::vector<Run> runs = find_runs(known, false, threads_);
  const std::vector<int> first = join_runs(runs, 1);
  struct Gap {
    int left = std::numeric_limits<int>::max(), right = -1, low = std::numeric_limits<int>::max(), high = -1;
    double area = 0;
  };
  std::vector<Gap> gaps(runs.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    Gap& hole = gaps[static_cast<std::size_t>(first[k])];
    hole.left = std::min(hole.left, runs[k].begin), hole.right = std::max(hole.right, runs[k].end - 1);
    hole.low = std::min(hole.low, runs[k].row), hole.high = std::max(hole.high, runs[k].row);
    for (int i = runs[k].begin; i < runs[k].end; ++i) hole.area += cell_mm2_[known.index(i, runs[k].row)];
  }
  double missing = 0;
  for (const Gap& hole : gaps) {
    if (hole.right < 0) continue;
    const bool at_border = hole.left == 0 || hole.low == 0 || hole.right == known.nx - 1 || hole.high == known.ny - 1;
    const double across = (hole.right - hole.left + 1) * MeshPass::cell_columns * mesh_.pixel_mm;
    const double down = (hole.high - hole.low + 1) * mesh_.row_step * mesh_.pixel_mm;
    if (at_border || std::max(across, down) > options_.front.fill.diameter) missing += hole.area;
  }
  known_mm2_ = std::max(0.0, visible_mm2_ - missing);
}

Grid<float> RegionFront::overview() const {
  Grid<float> out = overview_cell_.like<float>(nan);
  const std::vector<float>& cells = pass_.cell_height();
  for (std::size_t k = 0; k < out.size(); ++k)
    if (overview_cell_.values[k] >= 0) out.values[k] = cells[static_cast<std::size_t>(overview_cell_.values[k])];
  const int step = overview_step_;
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const Window& w = regions_[r].window;
    const Grid<float>& exact = maps_[r].heights;
    for (int j = (w.j0 + step - 1) / step; j * step < w.j1; ++j)
      for (int i = (w.i0 + step - 1) / step; i * step < w.i1; ++i) out.at(i, j) = exact.at(i * step - w.i0, j * step - w.j0);
  }
  return out;
}

}  // namespace debulk
