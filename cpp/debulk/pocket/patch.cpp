#include "debulk/pocket/patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "debulk/core/error.hpp"

namespace debulk {

void PatchOptions::check() const {
  require(std::isfinite(margin_mm) && margin_mm >= 0, "margin_mm", "a length in mm, not negative", margin_mm);
  require(std::isfinite(fade_mm) && fade_mm >= 0, "fade_mm", "a length in mm, not negative", fade_mm);
}

namespace {

// Steps along x and y.
struct Offset {
  std::int16_t i = kNone, j = 0;
  static constexpr std::int16_t kNone = std::numeric_limits<std::int16_t>::max();
  bool found() const { return i != kNone; }
  bool marked() const { return i == 0 && j == 0; }
  int squared() const { return i * i + j * j; }
};

// From every point to (nearly) the nearest marked one, as far as `reach` points: vectors handed on from neighbour to
// neighbour, down and up.
Grid<Offset> nearest_marked(const Grid<std::uint8_t>& marked, int reach) {
  auto nearest = marked.like<Offset>();
  for (std::size_t k = 0; k < marked.size(); ++k)
    if (marked.values[k]) nearest.values[k] = {0, 0};
  const int farthest = reach < Offset::kNone ? reach * reach : std::numeric_limits<int>::max();
  const auto take = [&](Offset& here, const Offset* row, int i, int di, int dj) {
    if (i + di < 0 || i + di >= marked.nx || !row[i + di].found()) return;
    const Offset o{static_cast<std::int16_t>(row[i + di].i + di), static_cast<std::int16_t>(row[i + di].j + dj)};
    if (const int squared = o.squared(); squared <= farthest && (!here.found() || squared < here.squared())) here = o;
  };
  const auto sweep_row = [&](int j, int dj) {
    Offset* row = &nearest.at(0, j);
    if (j + dj >= 0 && j + dj < marked.ny) {
      const Offset* beside = &nearest.at(0, j + dj);
      for (int i = 0; i < marked.nx; ++i)
        if (!row[i].marked())
          for (int di = -1; di <= 1; ++di) take(row[i], beside, i, di, dj);
    }
    for (int i = 0; i < marked.nx; ++i)
      if (!row[i].marked()) take(row[i], row, i, -1, 0);
    for (int i = marked.nx - 1; i >= 0; --i)
      if (!row[i].marked()) take(row[i], row, i, 1, 0);
  };
  for (int j = 0; j < marked.ny; ++j) sweep_row(j, -1);
  for (int j = marked.ny - 1; j >= 0; --j) sweep_row(j, 1);
  return nearest;
}

// 1 at 0, 0 from 1 on, level at both ends.
double fade(double u) {
  return u >= 1 ? 0.0 : (1 - u) * (1 - u) * (1 + 2 * u);
}

// The part of the height map round the perimeter, and where its points lie in the map.
struct PatchWindow {
  int i0, j0;
  const Segmentation& segmentation;
  const FootMap& feet;
  PlyMask ply;  // on the patch's points, beyond the map too; everywhere for a pocket that does not touch the ply's edge

  bool known(int i, int j) const {
    return feet.heights.contains(i + i0, j + j0) && !std::isnan(feet.heights.at(i + i0, j + j0)) && segmentation.ply.on_ply(i + i0, j + j0);
  }
  bool off_ply(int i, int j) const { return !ply.on_ply(i, j); }
  double height(int i, int j) const { return feet.heights.at(i + i0, j + j0); }
};

// Adds max(ply - t, F) - F to the surface within, and its way down to 0 outside.
void add_foot_excess(const PatchWindow& window, const Grid<std::uint8_t>& within, const PatchOptions& options, Grid<double>& surface) {
  // Points within and, as far as what stands up there reaches, round them.
  const double t = window.feet.options.thickness_mm, spacing = within.spacing;
  const double off_ply_mm = std::max(options.margin_mm, options.fade_mm);
  const int reach = static_cast<int>(std::ceil((window.ply.known() ? off_ply_mm : options.fade_mm) / spacing));
  int left = within.nx, right = -1, bottom = within.ny, top = -1;
  for (int j = 0; j < within.ny; ++j) {
    const std::uint8_t *row = &within.at(0, j), *end = row + within.nx, *first = std::find(row, end, 1);
    if (first == end) continue;
    while (end[-1] == 0) --end;
    left = std::min(left, static_cast<int>(first - row)), right = std::max(right, static_cast<int>(end - row) - 1);
    bottom = std::min(bottom, j), top = j;
  }
  if (right < 0) return;
  left = std::max(left - reach, 0), right = std::min(right + reach, within.nx - 1);
  bottom = std::max(bottom - reach, 0), top = std::min(top + reach, within.ny - 1);
  Grid<std::uint8_t> marked(right - left + 1, top - bottom + 1, within.position(left, bottom), spacing);
  bool all_known = true;
  for (int j = bottom; j <= top; ++j)
    for (int i = left; i <= right; ++i) {
      if (!within.at(i, j)) continue;
      const bool known = window.known(i, j);
      marked.at(i - left, j - bottom) = known;
      all_known = all_known && known;
    }

  const Grid<Offset> nearest = nearest_marked(marked, all_known ? reach : Offset::kNone);
  for (int j = bottom; j <= top; ++j)
    for (int i = left; i <= right; ++i) {
      const Offset o = nearest.at(i - left, j - bottom);
      if (!o.found()) continue;
      const double edge = std::max(window.height(i + o.i, j + o.j) - t, 0.0);  // for a point within: its own
      if (within.at(i, j)) {
        surface.at(i, j) += edge;
        continue;
      }
      const double here = window.known(i, j) ? std::clamp(window.height(i, j) - t, 0.0, edge) : edge;
      const double width = window.off_ply(i, j) ? off_ply_mm : options.fade_mm;
      if (width > 0) surface.at(i, j) += here * fade(std::sqrt(o.squared()) * spacing / width);
    }
}

}  // namespace

Patch make_patch(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const PatchOptions& options) {
  options.check();
  const int count = static_cast<int>(segmentation.pockets.size());
  require(id >= 1 && id <= count, "pocket_id", ("the id of a pocket, 1 to " + std::to_string(count)).c_str(), id);
  require(feet.feet.size() == segmentation.pockets.size() && feet.labels.size() == segmentation.labels.size(), "feet",
          "the feet of this segmentation", std::to_string(feet.feet.size()) + " feet for " + std::to_string(count) + " pockets");
  const Pocket& pocket = segmentation.pockets[static_cast<std::size_t>(id - 1)];
  const Foot& foot = feet.feet[static_cast<std::size_t>(id - 1)];
  const bool paper = options.mode == PatchMode::paper;

  Patch patch;
  patch.id = id;
  patch.mode = options.mode;
  patch.outline = paper ? pocket.outline : foot.outline;
  patch.area = paper ? pocket.area : foot.area;
  patch.closed = paper ? !pocket.touches_unknown : foot.closed;
  patch.touches_ply_edge = pocket.touches_ply_edge || (!paper && foot.touches_ply_edge);
  patch.parted = !paper && foot.parted;

  const Grid<float>& map = feet.heights;
  const Box box = bounding_box(patch.outline);
  const Eigen::Vector2d low = map.locate(box.low - Eigen::Vector2d::Constant(options.margin_mm));
  const Eigen::Vector2d high = map.locate(box.high + Eigen::Vector2d::Constant(options.margin_mm));
  PatchWindow window{static_cast<int>(std::floor(low.x())), static_cast<int>(std::floor(low.y())), segmentation, feet, {}};
  const int nx = static_cast<int>(std::ceil(high.x())) - window.i0 + 1, ny = static_cast<int>(std::ceil(high.y())) - window.j0 + 1;
  patch.within = Grid<std::uint8_t>(nx, ny, map.position(window.i0, window.j0), map.spacing);
  if (patch.touches_ply_edge && segmentation.options.ply_outline) window.ply = PlyMask(*segmentation.options.ply_outline, patch.within);
  const Grid<std::int32_t>& labels = paper ? segmentation.labels : feet.labels;
  const std::int32_t label = paper ? id : foot.label;
  const int first = std::max(0, -window.i0), end = std::min(nx, labels.nx - window.i0);  // columns on the map
  for (int j = std::max(0, -window.j0); j < std::min(ny, labels.ny - window.j0); ++j)
    for (int i = first; i < end; ++i) patch.within.at(i, j) = labels.at(i + window.i0, j + window.j0) == label;

  patch.surface = patch.within.like<double>();
  reference.heights_on(patch.surface, 1);
  if (options.keep_reference) patch.reference = patch.surface;
  if (!paper) {
    add_foot_excess(window, patch.within, options, patch.surface);
  } else {
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        if (patch.within.at(i, j) && window.known(i, j)) patch.surface.at(i, j) += window.height(i, j);
  }
  return patch;
}

}  // namespace debulk
