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

struct Offset {
  int i = 0, j = 0;
  bool found = false;
  double length() const { return found ? std::hypot(i, j) : std::numeric_limits<double>::infinity(); }
  long squared() const { return found ? static_cast<long>(i) * i + static_cast<long>(j) * j : std::numeric_limits<long>::max(); }
};

// From every point to (nearly) the nearest marked one: vectors handed on from neighbour to neighbour, down and up.
Grid<Offset> nearest_marked(const Grid<std::uint8_t>& marked) {
  auto nearest = marked.like<Offset>();
  for (std::size_t k = 0; k < marked.size(); ++k) nearest.values[k].found = marked.values[k] != 0;
  const auto take = [&](int i, int j, int di, int dj) {
    if (!nearest.contains(i + di, j + dj)) return;
    Offset o = nearest.at(i + di, j + dj);
    if (!o.found) return;
    o.i += di, o.j += dj;
    if (o.squared() < nearest.at(i, j).squared()) nearest.at(i, j) = o;
  };
  const auto sweep_row = [&](int j, int from) {
    for (int i = 0; i < marked.nx; ++i) {
      for (int di = -1; di <= 1; ++di) take(i, j, di, from);
      take(i, j, -1, 0);
    }
    for (int i = marked.nx - 1; i >= 0; --i) take(i, j, 1, 0);
  };
  for (int j = 0; j < marked.ny; ++j) sweep_row(j, -1);
  for (int j = marked.ny - 1; j >= 0; --j) sweep_row(j, 1);
  return nearest;
}

// 1 at 0, 0 from 1 on, level at both ends.
double fade(double u) {
  return u >= 1 ? 0.0 : (1 - u) * (1 - u) * (1 + 2 * u);
}

// The part of the height map round the perimeter, with its points' whereabouts there.
struct Window {
  int i0, j0;
  const Segmentation& segmentation;
  const FootMap& feet;
  PlyMask ply;  // on the patch's points, beyond the map too

  bool known(int i, int j) const {
    return feet.heights.contains(i + i0, j + j0) && !std::isnan(feet.heights.at(i + i0, j + j0)) && segmentation.ply.on_ply(i + i0, j + j0);
  }
  bool off_ply(int i, int j) const { return !ply.on_ply(i, j); }
  double height(int i, int j) const { return feet.heights.at(i + i0, j + j0); }
};

// max(ply - t, F) - F inside, and its way down to 0 outside.
Grid<double> foot_excess(const Window& window, const Grid<std::uint8_t>& within, const PatchOptions& options) {
  const double t = window.feet.options.thickness_mm, spacing = within.spacing;
  auto known_within = within;
  for (int j = 0; j < within.ny; ++j)
    for (int i = 0; i < within.nx; ++i)
      if (!window.known(i, j)) known_within.at(i, j) = 0;
  const Grid<Offset> nearest = nearest_marked(known_within);
  auto excess = within.like<double>();
  for (int j = 0; j < within.ny; ++j)
    for (int i = 0; i < within.nx; ++i) {
      const Offset& o = nearest.at(i, j);
      if (!o.found) continue;
      const double edge = std::max(window.height(i + o.i, j + o.j) - t, 0.0);  // for a point within: its own
      if (within.at(i, j)) {
        excess.at(i, j) = edge;
        continue;
      }
      const double here = window.known(i, j) ? std::clamp(window.height(i, j) - t, 0.0, edge) : edge;
      const double width = window.off_ply(i, j) ? std::max(options.margin_mm, options.fade_mm) : options.fade_mm;
      if (width > 0) excess.at(i, j) = here * fade(o.length() * spacing / width);
    }
  return excess;
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
  Window window{static_cast<int>(std::floor(low.x())), static_cast<int>(std::floor(low.y())), segmentation, feet, {}};
  const int nx = static_cast<int>(std::ceil(high.x())) - window.i0 + 1, ny = static_cast<int>(std::ceil(high.y())) - window.j0 + 1;
  patch.within = Grid<std::uint8_t>(nx, ny, map.position(window.i0, window.j0), map.spacing);
  if (segmentation.options.ply_outline) window.ply = PlyMask(*segmentation.options.ply_outline, patch.within);
  const Grid<std::int32_t>& labels = paper ? segmentation.labels : feet.labels;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      patch.within.at(i, j) = labels.contains(i + window.i0, j + window.j0) && labels.at(i + window.i0, j + window.j0) == id;

  auto excess = patch.within.like<double>();
  if (!paper) {
    excess = foot_excess(window, patch.within, options);
  } else {
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        if (patch.within.at(i, j) && window.known(i, j)) excess.at(i, j) = window.height(i, j);
  }
  patch.reference = patch.within.like<double>();
  patch.surface = patch.within.like<double>();
  reference.heights_on(patch.reference, 1);
  for (std::size_t k = 0; k < excess.size(); ++k) patch.surface.values[k] = patch.reference.values[k] + excess.values[k];
  return patch;
}

}  // namespace debulk
