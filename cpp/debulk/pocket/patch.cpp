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

constexpr double kSpreadPastEdge = 1.5;  // mm

// A vector in grid steps along x and y.
struct Offset {
  std::int16_t i = kNone, j = 0;
  static constexpr std::int16_t kNone = std::numeric_limits<std::int16_t>::max();
  bool found() const { return i != kNone; }
  bool marked() const { return i == 0 && j == 0; }
  int squared() const { return i * i + j * j; }
};

// The columns [begin, end) of a row.
struct Span {
  int begin, end;
};

// For each row, the unmarked points that may have a mark within `reach`. The grid's other points need not be looked
// at.
std::vector<std::vector<Span>> unmarked_within(const Grid<std::uint8_t>& marked, int reach) {
  std::vector<Span> extent(static_cast<std::size_t>(marked.ny), {marked.nx, 0});  // of a row's marks
  for (int j = 0; j < marked.ny; ++j) {
    const std::uint8_t *row = &marked.at(0, j), *end = row + marked.nx, *first = std::find(row, end, 1);
    if (first == end) continue;
    while (end[-1] == 0) --end;
    extent[static_cast<std::size_t>(j)] = {static_cast<int>(first - row), static_cast<int>(end - row)};
  }
  std::vector<std::vector<Span>> out(extent.size());
  const int near = std::min(reach, std::max(marked.nx, marked.ny));
  for (int j = 0; j < marked.ny; ++j) {
    Span within{marked.nx, 0};
    for (int k = std::max(0, j - near); k <= std::min(marked.ny - 1, j + near); ++k) {
      within.begin = std::min(within.begin, extent[static_cast<std::size_t>(k)].begin);
      within.end = std::max(within.end, extent[static_cast<std::size_t>(k)].end);
    }
    if (within.begin >= within.end) continue;
    const std::uint8_t *row = &marked.at(0, j), *last = row + std::min(marked.nx, within.end + near);
    for (const std::uint8_t* at = row + std::max(0, within.begin - near); at != last;) {
      const std::uint8_t* begin = std::find(at, last, 0);
      at = std::find(begin, last, 1);
      if (begin != at) out[static_cast<std::size_t>(j)].push_back({static_cast<int>(begin - row), static_cast<int>(at - row)});
    }
  }
  return out;
}

// The vector from every point to (nearly) the nearest marked one, up to `reach` points away. Vectors are handed on
// from neighbour to neighbour, downwards and upwards.
Grid<Offset> nearest_marked(const Grid<std::uint8_t>& marked, const std::vector<std::vector<Span>>& unmarked, int reach) {
  auto nearest = marked.like<Offset>();
  std::transform(marked.values.begin(), marked.values.end(), nearest.values.begin(),
                 [](std::uint8_t mark) { return mark ? Offset{0, 0} : Offset(); });
  const int farthest = reach < Offset::kNone ? reach * reach : std::numeric_limits<int>::max();
  const auto take = [&](Offset& here, const Offset* row, int i, int di, int dj) {
    if (i + di < 0 || i + di >= marked.nx || !row[i + di].found()) return;
    const Offset o{static_cast<std::int16_t>(row[i + di].i + di), static_cast<std::int16_t>(row[i + di].j + dj)};
    if (const int squared = o.squared(); squared <= farthest && (!here.found() || squared < here.squared())) here = o;
  };
  const auto sweep_row = [&](int j, int dj) {
    Offset* row = &nearest.at(0, j);
    for (const Span& span : unmarked[static_cast<std::size_t>(j)]) {
      if (j + dj >= 0 && j + dj < marked.ny) {
        const Offset* beside = &nearest.at(0, j + dj);
        for (int i = span.begin; i < span.end; ++i)
          for (int di = -1; di <= 1; ++di) take(row[i], beside, i, di, dj);
      }
      for (int i = span.begin; i < span.end; ++i) take(row[i], row, i, -1, 0);
      for (int i = span.end - 1; i >= span.begin; --i) take(row[i], row, i, 1, 0);
    }
  };
  for (int j = 0; j < marked.ny; ++j) sweep_row(j, -1);
  for (int j = marked.ny - 1; j >= 0; --j) sweep_row(j, 1);
  return nearest;
}

// Falls from 1 at u = 0 to 0 at u = 1 and beyond, with a slope of 0 at both ends.
double fade(double u) {
  return u >= 1 ? 0.0 : (1 - u) * (1 - u) * (1 + 2 * u);
}

// The part of the height map round the perimeter, and where its points lie in the map.
struct PatchWindow {
  int i0, j0, nx, ny;
  const Segmentation& segmentation;
  const FootMap& feet;
  PlyMask ply;  // on the patch's points, beyond the map too; everywhere if the pocket does not touch the ply's edge

  bool known(int i, int j) const {
    return feet.heights.contains(i + i0, j + j0) && !std::isnan(feet.heights.at(i + i0, j + j0)) && segmentation.ply.on_ply(i + i0, j + j0);
  }
  bool off_ply(int i, int j) const { return !ply.on_ply(i, j); }
  // Whether the ply's edge runs beside the point, so that its height may be partly the mold's.
  bool at_edge(int i, int j) const {
    const bool amid = !ply.known() || i == 0 || j == 0 || i == nx - 1 || j == ny - 1;
    return !amid && (off_ply(i - 1, j) || off_ply(i + 1, j) || off_ply(i, j - 1) || off_ply(i, j + 1));
  }
  double height(int i, int j) const { return feet.heights.at(i + i0, j + j0); }
};

// Each point past the ply's edge takes the height of one point near the edge. These heights scatter, because their fits are one-sided,
// and the streaks that this leaves would bend a fibre's path that runs along the edge. So the heights at `places` relax towards the mean
// of their neighbours, in as many Gauss-Seidel sweeps as spread a point's height over about the length `spread`.
void relax(const std::vector<std::size_t>& places, double spread, Grid<double>& heights) {
  const auto across = static_cast<std::size_t>(heights.nx);
  double* z = heights.values.data();
  const auto mean = [&](std::size_t k) { z[k] = 0.25 * (z[k - 1] + z[k + 1] + z[k - across] + z[k + across]); };
  const double cells = spread / heights.spacing;
  for (int sweep = static_cast<int>(std::ceil(cells * cells)); sweep > 0; --sweep) {
    if (sweep % 2 == 0)
      std::for_each(places.begin(), places.end(), mean);
    else
      std::for_each(places.rbegin(), places.rend(), mean);
  }
}

// Adds max(ply - t, F) - F to the surface within the pocket's region, and its fade to 0 outside.
void add_foot_excess(const PatchWindow& window, const Grid<std::uint8_t>& within, const PatchOptions& options, Grid<double>& surface) {
  // The points within the region, and those round it as far as its height reaches.
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
  auto above = marked.like<double>();
  bool all_marked = true;  // of the points within
  const auto mark_known = [&](bool edge_too) {
    for (int j = std::max(bottom, -window.j0); j <= std::min(top, window.feet.heights.ny - 1 - window.j0); ++j) {
      const std::uint8_t *in = &within.at(0, j), *on_ply = window.segmentation.ply.row(j + window.j0);
      const float* height = &window.feet.heights.at(0, j + window.j0);
      for (int i = left; i <= right; ++i) {
        if (!in[i]) continue;  // points off the map are not within, either
        const bool known = !std::isnan(height[i + window.i0]) && (!on_ply || on_ply[i + window.i0]);
        const bool counts = known && (edge_too || !window.at_edge(i, j));
        all_marked = all_marked && counts;
        if (!counts) continue;
        marked.at(i - left, j - bottom) = 1;
        above.at(i - left, j - bottom) = std::max(height[i + window.i0] - t, 0.0);
      }
    }
  };
  mark_known(false);
  const bool strip = std::find(marked.values.begin(), marked.values.end(), 1) == marked.values.end();
  if (strip) mark_known(true);  // along the edge, and no wider than the points beside it
  const int farthest = all_marked ? reach : Offset::kNone;
  const std::vector<std::vector<Span>> unmarked = unmarked_within(marked, farthest);
  const Grid<Offset> nearest = nearest_marked(marked, unmarked, farthest);
  std::vector<std::size_t> past_edge;
  std::vector<double> fades;  // of these points
  for (int j = bottom; j <= top; ++j)
    for (const Span& span : unmarked[static_cast<std::size_t>(j - bottom)])
      for (int i = left + span.begin; i < left + span.end; ++i) {
        const Offset o = nearest.at(i - left, j - bottom);
        if (!o.found()) continue;
        const bool past = window.off_ply(i, j) || window.at_edge(i, j);
        // The heights that count end about a point before the edge.
        const double width = past ? off_ply_mm : options.fade_mm, away = std::sqrt(o.squared()) * spacing - (past ? spacing : 0.0);
        if (!within.at(i, j) && away >= width) continue;
        const double edge = std::max(window.height(i + o.i, j + o.j) - t, 0.0), faded = within.at(i, j) ? 1.0 : fade(away / width);
        double& here = above.at(i - left, j - bottom);
        here = edge;
        if (window.known(i, j)) {
          const double own = window.height(i, j) - t;
          if (within.at(i, j))
            here = std::max(own, edge);  // the mold in a point at the edge only lowers it
          else if (!past)
            here = std::clamp(own, 0.0, edge);
        }
        if (past && i > left && i < right && j > bottom && j < top) {
          past_edge.push_back(static_cast<std::size_t>(j - bottom) * static_cast<std::size_t>(above.nx) +
                              static_cast<std::size_t>(i - left));
          fades.push_back(faded);
        } else {
          here *= faded;
        }
      }
  relax(past_edge, kSpreadPastEdge, above);
  for (std::size_t k = 0; k < past_edge.size(); ++k) above.values[past_edge[k]] *= fades[k];
  for (int j = bottom; j <= top; ++j)
    for (int i = left; i <= right; ++i) surface.at(i, j) += above.at(i - left, j - bottom);
}

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
