// RegionFront: the ply in the camera's view, and the overview of the whole height map.

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/pocket/dilate.hpp"
#include "debulk/region/region_work.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double ply_cell_mm = 2.0;
constexpr double beside_mm = 6.0;   // a high point up to this far off the ply still matters
constexpr double stands_mm = 30.0;  // a raised tile up to this far off the ply matters; at least a hole's diameter

bool marked_at(const Grid<std::uint8_t>& grid, const Eigen::Vector2d& xy) {
  if (!xy.allFinite()) return false;
  const Eigen::Vector2d cell = grid.locate(xy);
  if (!(cell.cwiseAbs().maxCoeff() < 1e6)) return false;
  const int i = static_cast<int>(std::lround(cell.x())), j = static_cast<int>(std::lround(cell.y()));
  return grid.contains(i, j) && grid.at(i, j) != 0;
}

// Returns the point of the reference under a pixel, mold XY; NaN outside the reference.
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
}

void RegionFront::prepare_overview() {
  overview_step_ = Overview::step(frame_.spacing);
  const int step = overview_step_;
  overview_cell_ = Grid<std::int32_t>((frame_.nx - 1) / step + 1, (frame_.ny - 1) / step + 1, frame_.origin, step * frame_.spacing, -1);
  overview_reference_ = overview_cell_.like<std::uint8_t>();
  for (int j = 0; j < overview_reference_.ny; ++j)
    for (int i = 0; i < overview_reference_.nx; ++i) overview_reference_.at(i, j) = gaps_.known(i * step, j * step);
  if (!mesh_.exists()) return;
  const Eigen::Matrix3d to_scanner = view_.rotation().transpose();
  constexpr int side = MeshPass::tile_side, across = MeshPass::cell_columns;
  const int pitch = (view_.width + side - 1) / side * (side / across);
  for (int j = 0; j < overview_cell_.ny; ++j)
    for (int i = 0; i < overview_cell_.nx; ++i) {
      if (!overview_reference_.at(i, j)) continue;
      const Eigen::Vector2d xy = overview_cell_.position(i, j);
      const Eigen::Vector3d p = to_scanner * (Eigen::Vector3d(xy.x(), xy.y(), reference_->height(xy)) - view_.centre());
      const double column = view_.camera.cx + p.x() / p.z() * view_.camera.f, row = view_.camera.cy + p.y() / p.z() * view_.camera.f;
      if (!(p.z() > 0 && column >= 0 && row >= 0 && column <= view_.width - 1 && row <= view_.height - 1)) continue;
      overview_cell_.at(i, j) = static_cast<int>(row) / mesh_.row_step * pitch + static_cast<int>(column) / across;
    }
}

// Asks for exact heights round each cell of the coarse pass that is above the cut in a block that is not yet to be
// exact. Most such cells hold two flying pixels, which exact heights leave out. If these heights were asked for only
// after the feet were found, they would cost the window a second round.
void RegionFront::look_closer(const std::vector<Window>& windows, Blocks& blocks) const {
  const Blocks before = blocks;
  const std::vector<float>& cells = pass_.cell_height();
  const int step = overview_step_, side = Blocks::side;
  for (const Window& w : windows)
    for (int j = (w.j0 + step - 1) / step; j * step < w.j1; ++j)
      for (int i = (w.i0 + step - 1) / step; i * step < w.i1; ++i) {
        const int cell = overview_cell_.at(i, j);
        if (cell < 0 || before.wanted(i * step / side, j * step / side)) continue;
        if (!(cells[static_cast<std::size_t>(cell)] > options_.segment.cut_height_mm)) continue;
        if (!marked_at(on_ply_, overview_cell_.position(i, j))) continue;
        const Window ring = grown({i * step, j * step, (i + 1) * step, (j + 1) * step}, side, frame_.nx, frame_.ny);
        blocks.add({std::max(ring.i0, w.i0), std::max(ring.j0, w.j0), std::min(ring.i1, w.i1), std::min(ring.j1, w.j1)}, w.top);
      }
}

Overview RegionFront::overview() const {
  Overview out{overview_cell_.like<float>(nan), overview_cell_.like<std::uint8_t>(), overview_reference_};
  const std::vector<float>& cells = pass_.cell_height();
  for (std::size_t k = 0; k < out.heights.size(); ++k) {
    if (overview_cell_.values[k] < 0) continue;
    out.heights.values[k] = cells[static_cast<std::size_t>(overview_cell_.values[k])];
    out.measured.values[k] = !std::isnan(out.heights.values[k]);
  }
  const int step = overview_step_;
  for (std::size_t r = 0; r < regions_.size(); ++r) {
    const Window& w = regions_[r]->window;
    const HeightMap& map = works_[r]->map;
    for (int j = (w.j0 + step - 1) / step; j * step < w.j1; ++j)
      for (int i = (w.i0 + step - 1) / step; i * step < w.i1; ++i) {
        out.heights.at(i, j) = map.heights.at(i * step - w.i0, j * step - w.j0);
        out.measured.at(i, j) = map.measured.at(i * step - w.i0, j * step - w.j0);
      }
  }
  return out;
}

}  // namespace debulk
