// RegionFront: the exact heights of the windows.

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/region/region_work.hpp"
#include "debulk/surface/median.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double above_mm = 2.0;      // a window's image part covers heights from this far below 0 to this far above its top
constexpr double depth_slack = 60.0;  // mm; points may be this much nearer to the camera when the image part is chosen

}  // namespace

// Returns the part of the image with every pixel at which the window's points may be looked up, and the margin that
// exact outlier decisions need.
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
  const auto down = [](int pixel) { return pixel / 16 * 16; };  // so that the tiles of the part are tiles of the whole image
  part.column = down(std::clamp(static_cast<int>(std::floor(left)) - margin, 0, view_.width - 1));
  part.row = down(std::clamp(static_cast<int>(std::floor(top)) - margin, 0, view_.height - 1));
  part.width = std::clamp(static_cast<int>(std::ceil(right)) + margin + 1, part.column + 1, view_.width) - part.column;
  part.height = std::clamp(static_cast<int>(std::ceil(bottom)) + margin + 1, part.row + 1, view_.height) - part.row;
  part.width = std::max(part.width, std::min(16, view_.width - part.column));
  part.height = std::max(part.height, 2);
  part.row = std::min(part.row, down(view_.height - part.height));
  return part;
}

// Returns the smallest spare memory that is large enough, or the largest; never the memory of a result that is still
// held.
std::unique_ptr<RegionFront::Work> RegionFront::fresh_work(const Window& window) {
  const auto held = [](const std::unique_ptr<Work>& work) { return work->region.use_count() > 1; };
  spare_works_.erase(std::remove_if(spare_works_.begin(), spare_works_.end(), held), spare_works_.end());
  const auto room = [](const std::unique_ptr<Work>& work) { return work->map.heights.values.capacity(); };
  std::stable_sort(spare_works_.begin(), spare_works_.end(), [&](const auto& a, const auto& b) { return room(a) < room(b); });
  auto found = std::find_if(spare_works_.begin(), spare_works_.end(),
                            [&](const auto& work) { return room(work) >= static_cast<std::size_t>(window.size()); });
  if (found == spare_works_.end() && found != spare_works_.begin()) --found;
  std::unique_ptr<Work> out;
  if (found == spare_works_.end()) {
    out = std::make_unique<Work>();
  } else {
    out = std::move(*found);
    spare_works_.erase(found);
  }
  out->region->window = window;
  out->done = false, out->exact.clear(), out->to_make.clear(), out->to_refine.clear();
  return out;
}

void RegionFront::segment(Work& work, int threads, const Stop& stop) {
  const std::shared_ptr<Scratch> scratch = scratch_.borrow();
  scratch->segmenter.reuse(std::move(work.region->segmentation));
  scratch->segmenter.run(work.map.heights, options_.segment, &work.map.measured, &work.map.before_median, threads, stop);
  work.region->segmentation = scratch->segmenter.take();
}

// Fills the window with the heights of the coarse pass.
void RegionFront::lay_coarse(Work& work) const {
  const Window& w = work.window();
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

// Copies the exact heights of the windows that this one replaces; the rest of its rectangles is still to be made.
void RegionFront::take_over(Work& work, double margin) const {
  if (earlier_.empty()) {
    work.to_make = work.exact;
    return;
  }
  constexpr int side = Blocks::side;
  Blocks missing(frame_);
  const auto holds = [](const Window& w, const Window& o) { return w.i0 <= o.i0 && w.j0 <= o.j0 && o.i1 <= w.i1 && o.j1 <= w.j1; };
  for (const Window& strip : work.exact)
    for (int j = strip.j0; j < strip.j1; j += side)
      for (int i = strip.i0; i < strip.i1; i += side) {
        const Window block{i, j, std::min(i + side, strip.i1), std::min(j + side, strip.j1), strip.top};
        const auto has = [&](const auto& old) {
          return std::any_of(old->exact.begin(), old->exact.end(), [&](const Window& w) { return holds(w, block); });
        };
        const auto old = std::find_if(earlier_.begin(), earlier_.end(), has);
        if (old == earlier_.end()) {
          missing.add(block, block.top);
          continue;
        }
        const Window &to = work.window(), &from = (*old)->window();
        for (int row = block.j0; row < block.j1; ++row)
          std::copy_n(&(*old)->unfiltered.at(i - from.i0, row - from.j0), block.i1 - i, &work.map.heights.at(i - to.i0, row - to.j0));
      }
  for (const Window& strip : work.exact)
    for (const Window& window : missing.rectangles(strip, margin)) work.to_make.push_back(window);
}

// Returns false if the image part is not the pinhole camera's.
bool RegionFront::make_exact(const Window& strip, Work& work, const CloudView& scan, const std::uint8_t* masked, int threads,
                             const Stop& stop) {
  if (stop.now()) throw Stopped("a region's height map was stopped");
  const std::shared_ptr<Scratch> scratch = scratch_.borrow();
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
  image.decisions_only = true;
  image.tolerance = 0.01;
  const bool fits = image.run(part.view(), part.camera(view_.camera), options_.front.outliers, &base, threads, stop);
  if (fits) {
    Grid<float>& exact = scratch->other;
    exact.nx = strip.i1 - strip.i0, exact.ny = strip.j1 - strip.j0, exact.spacing = frame_.spacing;
    exact.values.resize(static_cast<std::size_t>(exact.nx) * static_cast<std::size_t>(exact.ny));
    gridding_->run(image, {part.column, part.row, part.width, part.height}, exact, strip.i0, strip.j0, image.isa, threads, stop);
    for (int j = 0; j < exact.ny; ++j)
      std::copy_n(&exact.at(0, j), exact.nx, &work.map.heights.at(strip.i0 - work.window().i0, strip.j0 - work.window().j0 + j));
  }
  return fits;
}

void RegionFront::filter(Work& work, int threads, const Stop& stop) {
  const auto check = [&] {
    if (stop.now()) throw Stopped("a region's height map was stopped");
  };
  const std::shared_ptr<Scratch> scratch = scratch_.borrow();
  Grid<float>& heights = work.map.heights;
  check();
  work.unfiltered = heights;
  gaps_.hide(heights, work.window().i0, work.window().j0);
  scratch->filling.run(heights, options_.front.fill, work.map.measured, threads, stop);
  if (options_.front.spike > 0) {
    without_spikes(heights, options_.front.spike, scratch->other, threads, stop);
    heights.values.swap(scratch->other.values);
  }
  work.map.before_median.values.clear();
  if (options_.front.median > 1) {
    median(heights, options_.front.median, work.map.before_median, threads, stop);
    heights.values.swap(work.map.before_median.values);
  }
}

}  // namespace debulk
