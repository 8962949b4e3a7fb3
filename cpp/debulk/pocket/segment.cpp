#include "debulk/pocket/segment.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"
#include "debulk/pocket/drop_out.hpp"
#include "debulk/pocket/outline.hpp"
#include "debulk/pocket/outline_search.hpp"
#include "debulk/pocket/smooth_outline.hpp"
#include "debulk/surface/thin_plate.hpp"

namespace debulk {

void SegmentOptions::check() const {
  const auto positive = [](double v) { return std::isfinite(v) && v > 0; };
  const auto not_negative = [](double v) { return std::isfinite(v) && v >= 0; };
  require(positive(cut_height_mm), "cut_height_mm", "a positive height in mm", cut_height_mm);
  require(not_negative(area_tol_mm2), "area_tol_mm2", "an area in mm2, not negative", area_tol_mm2);
  require(not_negative(peak_tol_mm), "peak_tol_mm", "a height in mm, not negative", peak_tol_mm);
  require(not_negative(edge_tol_mm), "edge_tol_mm", "a distance in mm, not negative", edge_tol_mm);
  require(not_negative(bridge_mm), "bridge_mm", "a length in mm, not negative", bridge_mm);
  require(not_negative(smooth_mm), "smooth_mm", "a length in mm, not negative", smooth_mm);
  require(not_negative(blur_mm2), "blur_mm2", "a variance in mm2, not negative", blur_mm2);
}

namespace {

constexpr double kSpeckShare = 0.05;  // of area_tol_mm2

// A weak pull towards level, for the directions in which a bridge at the edge of the data is free to tilt.
constexpr double kLevelling = 1e-4;

template <class T>
void check_grid(const Grid<T>& grid) {
  require(grid.nx >= 2 && grid.ny >= 2, "height_map", "a grid of at least 2 by 2 heights",
          std::to_string(grid.ny) + " by " + std::to_string(grid.nx));
  require(grid.size() == static_cast<std::size_t>(grid.nx) * grid.ny, "height_map", "nx * ny values", grid.size());
  require(std::isfinite(grid.spacing) && grid.spacing > 0, "height_map", "a positive spacing in mm", grid.spacing);
  require(grid.origin.allFinite(), "height_map", "an origin with finite coordinates", grid.origin.transpose());
}

#define DEBULK_KERNEL "debulk/pocket/segment_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

// Indices of a component's points, ascending.
std::vector<std::size_t> members(const Components& components, std::size_t component, int nx) {
  std::vector<std::size_t> out;
  for (const Run* run = components.begin(component); run != components.end(component); ++run)
    for (int i = run->begin; i < run->end; ++i)
      out.push_back(static_cast<std::size_t>(run->row) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i));
  return out;
}

bool reaches_border(const Components& components, std::size_t component, const Grid<float>& heights) {
  return std::any_of(components.begin(component), components.end(component),
                     [&](const Run& run) { return run.row == 0 || run.row == heights.ny - 1 || run.begin == 0 || run.end == heights.nx; });
}

// The points that both sets of runs hold.
void intersect(const std::vector<Run>& a, const std::vector<Run>& b, std::vector<Run>& out) {
  out.clear();
  for (auto p = a.begin(), q = b.begin(); p != a.end() && q != b.end();) {
    if (p->row == q->row && std::max(p->begin, q->begin) < std::min(p->end, q->end))
      out.push_back({p->row, std::max(p->begin, q->begin), std::min(p->end, q->end)});
    const bool p_first = p->row != q->row ? p->row < q->row : p->end < q->end;
    p_first ? void(++p) : void(++q);
  }
}

bool near_ply_edge(const Polygon& outline, const OutlineSearch& ply_edge, double tolerance) {
  const Box box = bounding_box(outline);  // every point lies within half its diagonal of the middle
  return ply_edge.within((box.low + box.high) / 2, (box.high - box.low).norm() / 2 + tolerance) &&
         std::any_of(outline.begin(), outline.end(), [&](const Eigen::Vector2d& p) { return ply_edge.within(p, tolerance); });
}

void take(Outline&& outline, Pocket& p) {
  p.outline = rounded(std::move(outline.polygon));
  p.area = polygon_area(p.outline);
  p.volume = outline.volume;
  p.centroid = polygon_centroid(p.outline);
  p.box = bounding_box(p.outline);
  p.touches_unknown |= outline.at_unknown || outline.at_grid_border;
  p.touches_ply_edge = outline.at_ply_edge;
}

Pocket measure(const Components& components, std::size_t component, Outline&& outline, const Segmentation& s, const Grid<float>& given,
               const Grid<std::uint8_t>* measured) {
  Pocket p;
  take(std::move(outline), p);
  float peak = -std::numeric_limits<float>::infinity();
  int peak_i = 0, peak_j = 0;
  long seen = 0;
  for (const Run* run = components.begin(component); run != components.end(component); ++run)
    for (int i = run->begin; i < run->end; ++i) {
      const float h = s.heights.at(i, run->row);
      if (h > peak) peak = h, peak_i = i, peak_j = run->row;
      seen += std::isfinite(given.at(i, run->row)) && (!measured || measured->at(i, run->row) != 0);
    }
  p.peak = peak;
  p.peak_position = s.heights.position(peak_i, peak_j);
  p.measured_share = static_cast<double>(seen) / static_cast<double>(components.points(component));
  return p;
}

// Measures the pocket on a smooth surface. The window follows the pocket's width (area over perimeter), so that a
// narrow pocket is not smoothed away.
void measure_smoothly(const Components& components, std::size_t component, const std::vector<std::uint8_t>& pocket, const Segmentation& s,
                      const Grid<float>* before_median, Pocket& p) {
  const SegmentOptions& o = s.options;
  const double window = std::min(o.smooth_mm, p.area / polygon_perimeter(p.outline));
  auto smooth =
      smooth_outline(components, component, pocket, s.heights, before_median, {o.cut_height_mm, window, o.blur_mm2, o.ply_outline});
  if (!smooth) return;
  take(std::move(smooth->outline), p);
  p.peak = smooth->peak, p.peak_position = smooth->peak_position;
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

void Segmenter::prepare(const Grid<float>& given, const SegmentOptions& options) {
  const auto same_place = [&](const Grid<float>& g) {
    return g.nx == given.nx && g.ny == given.ny && g.origin == given.origin && g.spacing == given.spacing;
  };
  std::optional<Polygon> outline;
  if (options.ply_outline) outline = checked_polygon(*options.ply_outline, "ply_outline");
  const bool same_ply = same_place(out_.heights) && outline == out_.options.ply_outline && outline.has_value() == out_.ply.known();
  out_.options = options, out_.options.ply_outline = outline;
  if (!same_ply) out_.ply = outline ? PlyMask(*outline, given) : PlyMask();
  out_.heights.reshape(given), out_.labels.reshape(given);
  out_.pockets.clear(), out_.dropped.clear(), out_.bridged.clear(), out_.unmeasured.clear(), out_.specks = 0;
}

// Takes over the heights, finds what is unknown and what is above the cut, and clears the labels. `given` may be the
// result itself.
void Segmenter::scan(const Grid<float>& given, int threads, const Stop& stop) {
  unknown_.clear(given.ny), high_.clear(given.ny);
  const Isa isa = best_isa();
  // The least float that is not below the cut.
  float cut = static_cast<float>(out_.options.cut_height_mm);
  if (cut < out_.options.cut_height_mm) cut = std::nextafter(cut, std::numeric_limits<float>::infinity());
  parallel_for(given.ny, StripRuns::rows, threads, stop, [&](long first, long last) {
    for (int j = static_cast<int>(first); j < last; ++j) {
      RunWriter unknown(unknown_.strip(first), j), high(high_.strip(first), j);
      DEBULK_ON(isa, run(&given.at(0, j), out_.ply.row(j), given.nx, cut, &out_.heights.at(0, j), unknown, high));
      std::fill_n(&out_.labels.at(0, j), given.nx, 0);
    }
  });
}

// Bridges unknown components: all of them, or those that the rule for drop-outs allows. No bridge depends on another,
// so their order does not matter. Returns whether any was bridged.
bool Segmenter::bridge_components(const Components& components, bool all_of_them, int threads, const Stop& stop) {
  const auto count = static_cast<std::size_t>(components.count());
  bridged_.assign(count, {});
  parallel_for(static_cast<long>(count), 1, threads, stop, [&](long begin, long) {
    const auto r = static_cast<std::size_t>(begin);
    if (!all_of_them && reaches_border(components, r, out_.heights)) return;
    const std::vector<std::size_t> points = members(components, r, out_.heights.nx);
    const DropOutOptions drop_out{out_.options.cut_height_mm / 4, out_.options.bridge_mm};
    if (all_of_them || is_drop_out(out_.heights, points, drop_out, stop)) bridged_[r] = thin_plate(out_.heights, points, kLevelling, stop);
  });
  bool any = false;
  for (std::size_t r = 0; r < count; ++r) {
    auto value = bridged_[r].begin();
    if (value == bridged_[r].end()) continue;
    any = true;
    out_.bridged.insert(out_.bridged.end(), components.begin(r), components.end(r));
    for (const Run* run = components.begin(r); run != components.end(r); ++run)
      for (int i = run->begin; i < run->end; ++i) out_.heights.at(i, run->row) = static_cast<float>(*value++);
  }
  return any;
}

// The filled image of what lies above the cut.
const std::vector<Run>& Segmenter::foreground(int threads, const Stop& stop) {
  const int nx = out_.heights.nx, ny = out_.heights.ny;
  if (out_.options.bridge_mm > 0 && bridge_components(unknown_components_.run(unknown_.join()), false, threads, stop))
    scan(out_.heights, threads, stop);
  const std::vector<Run>& filled = filling_.run(high_.join(), nx, ny);
  const auto has_unknown = [&](const Run& run) {
    const float* row = &out_.heights.at(0, run.row);
    return std::any_of(row + run.begin, row + run.end, [](float h) { return std::isnan(h); });
  };
  if (std::none_of(filling_.holes().begin(), filling_.holes().end(), has_unknown)) return filled;
  intersect(filling_.holes(), unknown_.join(), within_);  // surrounded by a pocket, and too large to be bridged before
  bridge_components(unknown_components_.run(within_), true, threads, stop);
  // Points that no bridge reaches do not belong to the image.
  known_.clear();
  for (const Run& run : filled) {
    RunWriter known(known_, run.row);
    for (int i = run.begin; i < run.end; ++i) known.add(i, !std::isnan(out_.heights.at(i, run.row)), 1);
    known.end(run.end);
  }
  return known_;
}

const Segmentation& Segmenter::run(const Grid<float>& given, const SegmentOptions& options, const Grid<std::uint8_t>* measured,
                                   const Grid<float>* before_median, int threads, const Stop& stop) {
  options.check();
  check_grid(given);
  require(!measured || (measured->nx == given.nx && measured->ny == given.ny), "measured", "a mask of the height map's shape",
          measured ? std::to_string(measured->ny) + " by " + std::to_string(measured->nx) : "none");
  if (before_median && before_median->size() == 0) before_median = nullptr;
  require(!before_median || (before_median->nx == given.nx && before_median->ny == given.ny), "before_median",
          "heights of the height map's shape",
          before_median ? std::to_string(before_median->ny) + " by " + std::to_string(before_median->nx) : "none");
  prepare(given, options);
  scan(given, threads, stop);
  if (measured) out_.unmeasured = find_runs(*measured, false, threads);
  const Components& components = components_.run(foreground(threads, stop));
  const auto count = static_cast<std::size_t>(components.count());
  for (std::size_t k = 0; k < count; ++k) paint(components, k, static_cast<std::int32_t>(k) + 1, out_.labels);
  std::vector<Outline> outlines = trace_outlines(components, out_.labels, out_.heights, options.cut_height_mm, out_.ply, threads, stop);
  std::vector<Pocket> found(count);
  parallel_for(static_cast<long>(count), 1, threads, stop, [&](long begin, long) {
    const auto k = static_cast<std::size_t>(begin);
    found[k] = measure(components, k, std::move(outlines[k]), out_, given, measured);
  });
  const auto small = [&](const Pocket& p) { return p.area < options.area_tol_mm2; };
  const auto low = [&](const Pocket& p) { return p.peak - options.cut_height_mm < options.peak_tol_mm; };
  std::vector<std::uint8_t> pocket(count);
  for (std::size_t k = 0; k < count; ++k) pocket[k] = !small(found[k]) && !low(found[k]);
  const OutlineSearch ply_edge(options.ply_outline.value_or(Polygon()));
  const double edge_tol = options.edge_tol_mm > 0 ? options.edge_tol_mm : 2 * given.spacing;
  const std::vector<std::size_t> order = largest_first(found);  // so that no thread is left with the largest at the end
  parallel_for(static_cast<long>(count), 1, threads, stop, [&](long begin, long) {
    const std::size_t k = order[static_cast<std::size_t>(begin)];
    if (!pocket[k]) return;
    if (options.smooth_mm > 0) measure_smoothly(components, k, pocket, out_, before_median, found[k]);
    found[k].touches_ply_edge |= near_ply_edge(found[k].outline, ply_edge, edge_tol);
  });

  std::vector<std::int32_t> id_of(count, 0);
  for (const std::size_t k : largest_first(found)) {
    Pocket& p = found[k];
    if (!pocket[k]) {
      if (p.area < kSpeckShare * options.area_tol_mm2) {
        ++out_.specks;
        continue;
      }
      const auto reason = !low(p) ? Dropped::Reason::area : small(p) ? Dropped::Reason::area_and_peak : Dropped::Reason::peak;
      out_.dropped.push_back({reason, p.area, p.peak, p.centroid, p.touches_unknown});
      continue;
    }
    p.id = static_cast<int>(out_.pockets.size()) + 1;
    id_of[k] = p.id;
    out_.pockets.push_back(std::move(p));
  }
  for (std::size_t k = 0; k < count; ++k) paint(components, k, id_of[k], out_.labels);
  return out_;
}

Segmentation segment(const Grid<float>& heights, const SegmentOptions& options, const Grid<std::uint8_t>* measured,
                     const Grid<float>* before_median, int threads, const Stop& stop) {
  Segmenter segmenter;
  segmenter.run(heights, options, measured, before_median, threads, stop);
  return segmenter.take();
}

}  // namespace debulk
