// RegionFront: the ply in the camera's view, and the whole of it at a glance.

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/row_runs.hpp"
#include "debulk/pocket/dilate.hpp"
#include "debulk/region/region_work.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double ply_cell_mm = 2.0;
constexpr double beside_mm = 6.0;    // a high point so far off the ply still matters
constexpr double stands_mm = 30.0;   // and what stands up so far off, at least a hole's diameter
constexpr double overview_mm = 2.0;  // spacing, about

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

void RegionFront::prepare_ply() {
  const int nx = static_cast<int>(frame_.nx * frame_.spacing / ply_cell_mm) + 2,
            ny = static_cast<int>(frame_.ny * frame_.spacing / ply_cell_mm) + 2;
  on_ply_ = Grid<std::uint8_t>(nx, ny, frame_.origin, ply_cell_mm, 1);
  if (options_.segment.ply_outline) {
    const PlyMask ply(*options_.segment.ply_outline, on_ply_);
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) on_ply_.at(i, j) = ply.on_ply(i, j);
  }
  mesh_ = choose_mesh(base_, view_, options_.segment.area_tol_mm2, options_.segment.ply_outline ? &on_ply_ : nullptr);
  if (options_.row_step > 0) mesh_.row_step = options_.row_step, mesh_.column_step = options_.column_step;
  near_ply_ = dilate(on_ply_, static_cast<int>(std::ceil(beside_mm / ply_cell_mm)));
  const double stands = std::max(stands_mm, options_.front.fill.diameter + 2 * ply_cell_mm);
  const Grid<std::uint8_t> far = dilate(on_ply_, static_cast<int>(std::ceil(stands / ply_cell_mm)));

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
  for (int j = 0; j < tiles_y; ++j) {
    TileSpan span{tiles_x, 0};
    for (int i = 0; i < tiles_x; ++i) {
      tile_near_.push_back(marked_at(far, under(base_, view_, (i + 0.5) * side, (j + 0.5) * side)));
      if (tile_near_.back()) span = {std::min(span.begin, i), i + 1};
    }
    spans_.push_back(span);
  }
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

// Area of the ply that is known: what the camera can see of it, less the holes that would not be filled.
void RegionFront::account_for_holes() {
  Grid<std::uint8_t> known(pass_.cells_x(), pass_.cells_y(), Eigen::Vector2d::Zero(), 1, 1);  // what is far off the ply, too
  for (int j = 0; j < known.ny; ++j) {
    const float* row = &pass_.cell_height()[static_cast<std::size_t>(j) * static_cast<std::size_t>(pass_.cell_pitch())];
    const TileSpan& span = spans_[static_cast<std::size_t>(j * mesh_.row_step / MeshPass::tile_side)];
    constexpr int cells = MeshPass::tile_side / MeshPass::cell_columns;
    for (int i = span.begin * cells; i < std::min(known.nx, span.end * cells); ++i) known.at(i, j) = row[i] == row[i];
  }
  const std::vector<Run> runs = find_runs(known, false, 1);
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
    const Window& w = regions_[r]->window;
    const Grid<float>& exact = works_[r]->map.heights;
    for (int j = (w.j0 + step - 1) / step; j * step < w.j1; ++j)
      for (int i = (w.i0 + step - 1) / step; i * step < w.i1; ++i) out.at(i, j) = exact.at(i * step - w.i0, j * step - w.j0);
  }
  return out;
}

}  // namespace debulk
