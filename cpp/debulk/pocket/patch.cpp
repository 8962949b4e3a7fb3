#include "debulk/pocket/patch.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "debulk/core/error.hpp"
#include "debulk/pocket/foot_excess.hpp"

namespace debulk {

void PatchOptions::check() const {
  require(std::isfinite(margin_mm) && margin_mm >= 0, "margin_mm", "a length in mm, not negative", margin_mm);
  require(std::isfinite(fade_mm) && fade_mm >= 0, "fade_mm", "a length in mm, not negative", fade_mm);
}

namespace {

// The properties of a pocket that depend on the patch's mode.
struct Chosen {
  const Polygon& outline;
  double area;
  bool closed, touches_ply_edge, parted;
};

Chosen chosen(const Segmentation& segmentation, const FootMap& feet, int id, const PatchOptions& options) {
  options.check();
  const int count = static_cast<int>(segmentation.pockets.size());
  require(id >= 1 && id <= count, "pocket_id", ("the id of a pocket, 1 to " + std::to_string(count)).c_str(), id);
  require(feet.feet.size() == segmentation.pockets.size() && feet.labels.size() == segmentation.labels.size(), "feet",
          "the feet of this segmentation", std::to_string(feet.feet.size()) + " feet for " + std::to_string(count) + " pockets");
  const Pocket& pocket = segmentation.pockets[static_cast<std::size_t>(id - 1)];
  const Foot& foot = feet.feet[static_cast<std::size_t>(id - 1)];
  if (options.mode == PatchMode::paper) return {pocket.outline, pocket.area, !pocket.touches_unknown, pocket.touches_ply_edge, false};
  return {foot.outline, foot.area, foot.closed, pocket.touches_ply_edge || foot.touches_ply_edge, foot.parted};
}

// The part of the height map that holds the outline and `margin_mm` round it.
PatchWindow window_round(const Polygon& outline, double margin_mm, const Segmentation& segmentation, const FootMap& feet) {
  const Grid<float>& map = feet.heights;
  const Box box = bounding_box(outline);
  const Eigen::Vector2d low = map.locate(box.low - Eigen::Vector2d::Constant(margin_mm));
  const Eigen::Vector2d high = map.locate(box.high + Eigen::Vector2d::Constant(margin_mm));
  const int i0 = static_cast<int>(std::floor(low.x())), j0 = static_cast<int>(std::floor(low.y()));
  const int nx = static_cast<int>(std::ceil(high.x())) - i0 + 1, ny = static_cast<int>(std::ceil(high.y())) - j0 + 1;
  return {i0, j0, nx, ny, segmentation, feet, {}};
}

// Adds the height of the pocket above F, and of its surroundings, to a surface in the window. Returns the pocket's own
// points.
Grid<std::uint8_t> add_excess(PatchWindow& window, int id, bool at_ply_edge, const PatchOptions& options, Grid<double>& surface) {
  const bool paper = options.mode == PatchMode::paper;
  auto within = surface.like<std::uint8_t>();
  if (at_ply_edge && window.segmentation.options.ply_outline) window.ply = PlyMask(*window.segmentation.options.ply_outline, within);
  const Grid<std::int32_t>& labels = paper ? window.segmentation.labels : window.feet.labels;
  const std::int32_t label = paper ? id : window.feet.feet[static_cast<std::size_t>(id - 1)].label;
  const int first = std::max(0, -window.i0), end = std::min(window.nx, labels.nx - window.i0);  // columns on the map
  for (int j = std::max(0, -window.j0); j < std::min(window.ny, labels.ny - window.j0) && first < end; ++j) {
    const std::int32_t* from = &labels.at(first + window.i0, j + window.j0);
    std::transform(from, from + (end - first), &within.at(first, j), [label](std::int32_t l) { return l == label; });
  }
  if (!paper) {
    add_foot_excess(window, within, options, surface);
  } else {
    for (int j = 0; j < window.ny; ++j)
      for (int i = 0; i < window.nx; ++i)
        if (within.at(i, j) && window.known(i, j)) surface.at(i, j) += window.height(i, j);
  }
  return within;
}

}  // namespace

Patch make_patch(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const PatchOptions& options) {
  const Chosen what = chosen(segmentation, feet, id, options);
  Patch patch;
  patch.id = id;
  patch.mode = options.mode;
  patch.outline = what.outline;
  patch.area = what.area;
  patch.closed = what.closed;
  patch.touches_ply_edge = what.touches_ply_edge;
  patch.parted = what.parted;
  PatchWindow window = window_round(what.outline, options.margin_mm, segmentation, feet);
  patch.surface = Grid<double>(window.nx, window.ny, feet.heights.position(window.i0, window.j0), feet.heights.spacing);
  reference.heights_on(patch.surface, 1);
  patch.reference = patch.surface;
  patch.within = add_excess(window, id, what.touches_ply_edge, options, patch.surface);
  return patch;
}

Grid<double> patch_excess(const Segmentation& segmentation, const FootMap& feet, int id, const PatchOptions& options, int border) {
  const Chosen what = chosen(segmentation, feet, id, options);
  const bool off_ply = what.touches_ply_edge && segmentation.options.ply_outline;
  const double reach_mm = off_ply ? std::max(options.margin_mm, options.fade_mm) : options.fade_mm;
  PatchWindow window = window_round(what.outline, reach_mm + border * feet.heights.spacing, segmentation, feet);
  Grid<double> excess(window.nx, window.ny, feet.heights.position(window.i0, window.j0), feet.heights.spacing);
  add_excess(window, id, what.touches_ply_edge, options, excess);
  return excess;
}

}  // namespace debulk
