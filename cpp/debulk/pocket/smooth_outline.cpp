#include "debulk/pocket/smooth_outline.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/pocket/dilate.hpp"
#include "debulk/pocket/smooth.hpp"

namespace debulk {
namespace {

constexpr int squares = 8;           // along a window: more hardly improve the result
constexpr int half = squares / 2;    // a window's reach in squares
constexpr double at_the_edge = 0.2;  // share of a window that must be known to give a height next to the ply's edge

constexpr unsigned ours = 1, theirs = 2, beside = 4, at_edge = 8;  // marks of a square

// The heights of a component and its surroundings, averaged over squares of `side` cells, and the marks of the
// squares.
struct Squares {
  Grid<float> heights;
  Grid<std::uint8_t> marks;
};

// Squares lie at multiples of their side from mold (0, 0), so that a part of the map gives the same as the whole.
int first_square(double origin, double spacing, int cell, int side) {
  return static_cast<int>(std::floor((std::round(origin / spacing) + cell) / side));
}

Squares gather(const Components& components, std::size_t component, const std::vector<std::uint8_t>& pocket, const Grid<float>& heights,
               const Grid<float>* before_median, int side) {
  const Run *begin = components.begin(component), *end = components.end(component);
  int left = heights.nx, right = 0;
  for (const Run* run = begin; run != end; ++run) left = std::min(left, run->begin), right = std::max(right, run->end);
  const int margin = 2 * half + 2;  // the contour is sought within half of it, and windows reach as far again
  const auto cell_of = [&](int square, double origin) { return square * side - static_cast<int>(std::round(origin / heights.spacing)); };
  const int u0 = first_square(heights.origin.x(), heights.spacing, left, side) - margin,
            u1 = first_square(heights.origin.x(), heights.spacing, right - 1, side) + margin + 1,
            v0 = first_square(heights.origin.y(), heights.spacing, begin->row, side) - margin,
            v1 = first_square(heights.origin.y(), heights.spacing, (end - 1)->row, side) + margin + 1;
  const int i0 = cell_of(u0, heights.origin.x()), j0 = cell_of(v0, heights.origin.y());
  const double middle = (side - 1) / 2.0;
  Squares out;
  out.heights = Grid<float>(u1 - u0, v1 - v0, heights.position(i0 + middle, j0 + middle), side * heights.spacing,
                            std::numeric_limits<float>::quiet_NaN());
  out.marks = out.heights.like<std::uint8_t>();
  // The squares that lie wholly on the map.
  const int first = i0 < 0 ? (side - 1 - i0) / side : 0, last = std::min(out.heights.nx, (heights.nx - i0) / side);
  std::vector<double> sums(static_cast<std::size_t>(out.heights.nx));
  for (int v = 0; v < out.heights.ny; ++v) {
    const int j1 = j0 + v * side;
    if (j1 < 0 || j1 + side > heights.ny) continue;
    std::fill(sums.begin(), sums.end(), 0.0);
    for (int j = j1; j < j1 + side; ++j) {
      const float *h = &heights.at(0, j), *sharp = before_median ? &before_median->at(0, j) : h;
      for (int u = first; u < last; ++u)
        for (int i = i0 + u * side; i < i0 + (u + 1) * side; ++i)
          // Bridged heights, and those off the ply, are taken from `heights`.
          sums[static_cast<std::size_t>(u)] += std::isnan(sharp[i]) || std::isnan(h[i]) ? h[i] : sharp[i];
    }
    for (int u = first; u < last; ++u) out.heights.at(u, v) = static_cast<float>(sums[static_cast<std::size_t>(u)] / (side * side));
  }
  for (std::size_t r = 0; r < pocket.size(); ++r) {
    if (pocket[r] == 0) continue;
    for (const Run* run = components.begin(r); run != components.end(r); ++run) {
      const int j = run->row - j0, i1 = std::max(run->begin - i0, 0), i2 = std::min(run->end - i0, out.marks.nx * side);
      if (j < 0 || j >= out.marks.ny * side || i1 >= i2) continue;
      std::uint8_t* mark = &out.marks.at(0, j / side);
      for (int u = i1 / side; u <= (i2 - 1) / side; ++u) mark[u] |= r == component ? ours : theirs;
    }
  }
  return out;
}

// Heights next to the ply's edge partly show what lies beside it, and off the ply nothing belongs to the pocket.
void leave_out_the_edge(Squares& s, const PlyMask& ply) {
  for (int v = 0; v < s.heights.ny; ++v)
    for (int u = 0; u < s.heights.nx; ++u)
      if (!ply.on_ply(u, v)) s.marks.at(u, v) = beside;
  const Grid<std::uint8_t> near = dilate(s.marks, 1);
  for (std::size_t k = 0; k < near.size(); ++k)
    if (near.values[k] & beside) s.heights.values[k] = std::numeric_limits<float>::quiet_NaN(), s.marks.values[k] |= at_edge;
}

}  // namespace

std::optional<SmoothOutline> smooth_outline(const Components& found, std::size_t component, const std::vector<std::uint8_t>& pocket,
                                            const Grid<float>& heights, const Grid<float>* before_median,
                                            const SmoothOutlineOptions& options) {
  if (options.window_mm < 2 * heights.spacing) return {};
  const int side = std::max(1, static_cast<int>(options.window_mm / (squares * heights.spacing) + 1e-6));
  Squares s = gather(found, component, pocket, heights, before_median, side);
  PlyMask ply;
  if (options.ply_outline) {
    ply = PlyMask(*options.ply_outline, s.heights);
    leave_out_the_edge(s, ply);
  }
  // Where the surroundings of a pocket and a neighbour meet, only the pocket's own component belongs to it.
  Grid<std::uint8_t> where = dilate(s.marks, half);
  for (std::size_t k = 0; k < where.size(); ++k) {
    const unsigned mark = s.marks.values[k], near = where.values[k] & (ours | theirs);
    const bool known = !std::isnan(s.heights.values[k]) || (mark & at_edge);
    where.values[k] = known && !(mark & beside) && (near == ours || (mark & (ours | theirs)) == ours);
  }
  // Gridding and filters blur, and so do the squares. Straight lines between the fits' heights would blur a crest once
  // more, by s² / 6 on average over a side of length s.
  const double blur =
      options.blur_mm2 + heights.spacing * heights.spacing * (side * side - 1) / 12.0 + s.heights.spacing * s.heights.spacing / 6.0;
  const Grid<float> surface = smooth_heights(s.heights, ply, {options.window_mm, blur, at_the_edge}, &where, 1);

  Grid<std::uint8_t> high = surface.like<std::uint8_t>();
  for (std::size_t k = 0; k < high.size(); ++k) high.values[k] = where.values[k] != 0 && surface.values[k] >= options.level;
  RunFilling filling;
  RunJoining joining;
  const Components& components = joining.run(filling.run(find_runs(high, true, 1), high.nx, high.ny));
  std::size_t most = 0;
  long shared = 0;
  for (std::size_t r = 0; r < static_cast<std::size_t>(components.count()); ++r) {
    long count = 0;
    for (const Run* run = components.begin(r); run != components.end(r); ++run)
      for (int i = run->begin; i < run->end; ++i) count += (s.marks.at(i, run->row) & ours) != 0;
    if (count > shared) shared = count, most = r;
  }
  if (shared == 0) return {};
  Grid<std::int32_t> label = surface.like<std::int32_t>();
  SmoothOutline out;
  out.peak = -std::numeric_limits<double>::infinity();
  for (const Run* run = components.begin(most); run != components.end(most); ++run)
    for (int i = run->begin; i < run->end; ++i) {
      const double h = surface.at(i, run->row);
      if (std::isnan(h)) return {};
      label.at(i, run->row) = 1;
      if (h > out.peak) out.peak = h, out.peak_position = surface.position(i, run->row);
    }
  const Components one{{components.begin(most), components.end(most)},
                       {0, static_cast<std::size_t>(components.end(most) - components.begin(most))}};
  out.outline = trace_outlines(one, label, surface, options.level, ply, 1).front();
  return out;
}

}  // namespace debulk
