#include "debulk/pocket/segment.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/pocket/bridge.hpp"
#include "debulk/pocket/outline.hpp"
#include "debulk/pocket/regions.hpp"

namespace debulk {

void SegmentOptions::check() const {
  const auto positive = [](double v) { return std::isfinite(v) && v > 0; };
  const auto not_negative = [](double v) { return std::isfinite(v) && v >= 0; };
  require(positive(cut_height_mm), "cut_height_mm", "a positive height in mm", cut_height_mm);
  require(not_negative(area_tol_mm2), "area_tol_mm2", "an area in mm2, not negative", area_tol_mm2);
  require(not_negative(peak_tol_mm), "peak_tol_mm", "a height in mm, not negative", peak_tol_mm);
  require(not_negative(edge_tol_mm), "edge_tol_mm", "a distance in mm, not negative", edge_tol_mm);
  require(not_negative(bridge_mm), "bridge_mm", "a length in mm, not negative", bridge_mm);
}

namespace {

constexpr double kSpeckShare = 0.05;  // of AreaTol

template <class T>
void check_grid(const Grid<T>& grid) {
  require(grid.nx >= 2 && grid.ny >= 2, "height_map", "a grid of at least 2 by 2 heights",
          std::to_string(grid.ny) + " by " + std::to_string(grid.nx));
  require(grid.size() == static_cast<std::size_t>(grid.nx) * grid.ny, "height_map", "nx * ny values", grid.size());
  require(std::isfinite(grid.spacing) && grid.spacing > 0, "height_map", "a positive spacing in mm", grid.spacing);
  require(grid.origin.allFinite(), "height_map", "an origin with finite coordinates", grid.origin.transpose());
}

// Indices of the points of each component, by label.
std::vector<std::vector<std::size_t>> members(const Grid<std::int32_t>& labels, int count) {
  std::vector<std::vector<std::size_t>> out(static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (labels.values[k] > 0) out[static_cast<std::size_t>(labels.values[k] - 1)].push_back(k);
  return out;
}

// Bridges every unknown region that `allowed` accepts, given its points. None leans on another's bridge, so that their
// order does not matter.
template <class Allowed>
void bridge_regions(Grid<float>& heights, const Grid<std::uint8_t>& unknown, const Allowed& allowed) {
  int count = 0;
  const Grid<std::int32_t> regions = connected_components(unknown, count);
  const auto points = members(regions, count);
  std::vector<std::vector<float>> bridged(points.size());
  parallel_for(count, 8, 0, [&](long begin, long end) {
    for (auto r = static_cast<std::size_t>(begin); r < static_cast<std::size_t>(end); ++r)
      if (allowed(points[r])) bridged[r] = bridge(heights, points[r]);
  });
  for (std::size_t r = 0; r < points.size(); ++r)
    for (std::size_t k = 0; k < bridged[r].size(); ++k) heights.values[points[r][k]] = bridged[r][k];
}

// How many steps to a neighbour it takes from a known height to the innermost point of a region (ascending indices).
int depth(const Grid<float>& heights, const std::vector<std::size_t>& region) {
  std::vector<int> steps(region.size(), 0);  // 0: not reached yet
  const auto number = [&](int i, int j) -> long {
    const auto at = std::lower_bound(region.begin(), region.end(), heights.index(i, j));
    return at != region.end() && *at == heights.index(i, j) ? at - region.begin() : -1;
  };
  for (int step = 1;; ++step) {
    std::vector<std::size_t> reached;
    for (std::size_t n = 0; n < region.size(); ++n) {
      if (steps[n]) continue;
      const int i = static_cast<int>(region[n] % static_cast<std::size_t>(heights.nx)),
                j = static_cast<int>(region[n] / static_cast<std::size_t>(heights.nx));
      bool next_to = false;
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
          if (!heights.contains(i + di, j + dj)) continue;
          const long other = number(i + di, j + dj);
          next_to |= other >= 0 ? steps[static_cast<std::size_t>(other)] > 0 : !std::isnan(heights.at(i + di, j + dj));
        }
      if (next_to) reached.push_back(n);
    }
    if (reached.empty()) return std::count(steps.begin(), steps.end(), 0) ? std::numeric_limits<int>::max() : step - 1;
    for (const std::size_t n : reached) steps[n] = step;
  }
}

// The rule for drop-outs, before the cut (segment.hpp).
bool may_bridge(const Grid<float>& heights, const std::vector<std::size_t>& region, const SegmentOptions& options) {
  bool high_rim = false, at_border = false;
  for (const std::size_t k : region) {
    const int i = static_cast<int>(k % static_cast<std::size_t>(heights.nx)),
              j = static_cast<int>(k / static_cast<std::size_t>(heights.nx));
    at_border |= i == 0 || j == 0 || i == heights.nx - 1 || j == heights.ny - 1;
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di)
        if (heights.contains(i + di, j + dj)) high_rim |= heights.at(i + di, j + dj) >= options.cut_height_mm / 4;
  }
  return high_rim && !at_border && 2.0 * heights.spacing * depth(heights, region) <= options.bridge_mm + heights.spacing;
}

Grid<std::uint8_t> unknown_points(const Grid<float>& heights, const PlyMask& ply, const Grid<std::uint8_t>* within) {
  auto unknown = heights.like<std::uint8_t>();
  parallel_for(heights.ny, 64, 0, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < heights.nx; ++i)
        unknown.at(i, j) = std::isnan(heights.at(i, j)) && ply.on_ply(i, j) && (!within || within->at(i, j));
  });
  return unknown;
}

// Heights to be cut and the filled image of what lies above the cut.
Grid<std::uint8_t> foreground(Grid<float>& heights, const PlyMask& ply, const SegmentOptions& options) {
  if (options.bridge_mm > 0)
    bridge_regions(heights, unknown_points(heights, ply, nullptr),
                   [&](const std::vector<std::size_t>& region) { return may_bridge(heights, region, options); });
  auto image = heights.like<std::uint8_t>();
  for (std::size_t k = 0; k < image.size(); ++k) image.values[k] = heights.values[k] >= options.cut_height_mm;
  image = fill_holes(image);
  const auto surrounded = unknown_points(heights, ply, &image);  // by a pocket, and too large to be bridged before
  bridge_regions(heights, surrounded, [](const auto&) { return true; });
  for (std::size_t k = 0; k < image.size(); ++k) image.values[k] &= !std::isnan(heights.values[k]);
  return image;
}

bool near_ply_edge(const Polygon& outline, const SegmentOptions& options, double spacing) {
  if (!options.ply_outline) return false;
  const double tolerance = options.edge_tol_mm > 0 ? options.edge_tol_mm : 2 * spacing;
  const Box box = bounding_box(outline);  // every point lies within half its diagonal of the middle
  const double half = (box.high - box.low).norm() / 2;
  if (distance_to_outline(*options.ply_outline, (box.low + box.high) / 2) > half + tolerance) return false;
  return std::any_of(outline.begin(), outline.end(),
                     [&](const Eigen::Vector2d& p) { return distance_to_outline(*options.ply_outline, p) <= tolerance; });
}

Pocket measure(const std::vector<std::size_t>& points, Outline&& outline, const Segmentation& s, const Grid<float>& given,
               const Grid<std::uint8_t>* measured) {
  Pocket p;
  p.outline = std::move(outline.polygon);
  p.area = polygon_area(p.outline);
  p.volume = outline.volume;
  p.centroid = polygon_centroid(p.outline);
  p.box = bounding_box(p.outline);
  p.touches_unknown = outline.at_unknown || outline.at_grid_border;
  p.touches_ply_edge = outline.at_ply_edge || near_ply_edge(p.outline, s.options, s.heights.spacing);
  const auto highest = *std::max_element(points.begin(), points.end(),
                                         [&](std::size_t a, std::size_t b) { return s.heights.values[a] < s.heights.values[b]; });
  p.peak = s.heights.values[highest];
  const auto nx = static_cast<std::size_t>(s.heights.nx);
  p.peak_position = s.heights.position(static_cast<double>(highest % nx), static_cast<double>(highest / nx));
  const auto seen = std::count_if(points.begin(), points.end(),
                                  [&](std::size_t k) { return std::isfinite(given.values[k]) && (!measured || measured->values[k] != 0); });
  p.measured_share = static_cast<double>(seen) / static_cast<double>(points.size());
  return p;
}

template <class Found>
std::vector<std::size_t> largest_first(const std::vector<Found>& found) {
  std::vector<std::size_t> order(found.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto rounded = [&](std::size_t k) { return std::round(found[k].area * 1e6); };  // equal shapes tie in spite of rounding
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return rounded(a) > rounded(b); });
  return order;
}

}  // namespace

Segmentation segment(const Grid<float>& given, const SegmentOptions& options, const Grid<std::uint8_t>* measured) {
  options.check();
  check_grid(given);
  require(!measured || (measured->nx == given.nx && measured->ny == given.ny), "measured", "a mask of the height map's shape",
          measured ? std::to_string(measured->ny) + " by " + std::to_string(measured->nx) : "none");
  Segmentation out;
  out.options = options;
  out.heights = given;
  if (options.ply_outline) {
    out.options.ply_outline = checked_polygon(*options.ply_outline, "ply_outline");
    out.ply = PlyMask(*out.options.ply_outline, given);
  }
  parallel_for(given.ny, 64, 0, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < given.nx; ++i)
        if (!std::isfinite(given.at(i, j)) || !out.ply.on_ply(i, j)) out.heights.at(i, j) = std::numeric_limits<float>::quiet_NaN();
  });

  int count = 0;
  out.labels = connected_components(foreground(out.heights, out.ply, options), count);
  std::vector<Outline> outlines = trace_outlines(out.labels, count, out.heights, options.cut_height_mm, out.ply);
  const auto points = members(out.labels, count);
  std::vector<Pocket> found;
  for (std::size_t k = 0; k < points.size(); ++k) found.push_back(measure(points[k], std::move(outlines[k]), out, given, measured));

  std::vector<std::int32_t> id_of(found.size() + 1, 0);
  for (const std::size_t k : largest_first(found)) {
    Pocket& p = found[k];
    if (p.area < kSpeckShare * options.area_tol_mm2) {
      ++out.specks;
      continue;
    }
    const bool small = p.area < options.area_tol_mm2, low = p.peak - options.cut_height_mm < options.peak_tol_mm;
    if (small || low) {
      const auto reason = small && low ? Dropped::Reason::area_and_peak : small ? Dropped::Reason::area : Dropped::Reason::peak;
      out.dropped.push_back({reason, p.area, p.peak, p.centroid});
      continue;
    }
    p.id = static_cast<int>(out.pockets.size()) + 1;
    id_of[k + 1] = p.id;
    out.pockets.push_back(std::move(p));
  }
  for (std::int32_t& label : out.labels.values) label = id_of[static_cast<std::size_t>(label)];
  return out;
}

}  // namespace debulk
