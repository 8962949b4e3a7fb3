#include "debulk/pocket/unseen.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "debulk/core/row_runs.hpp"
#include "debulk/pocket/dilate.hpp"
#include "debulk/pocket/ply_mask.hpp"

namespace debulk {
namespace {

using Mask = Grid<std::uint8_t>;

// The overview's points, and as many beyond as the outline reaches.
struct Field {
  int i0 = 0, j0 = 0;  // of the overview, in this grid
  Mask ply;
};

Field field_of(const Overview& overview, const UnseenOptions& options) {
  const Grid<float>& heights = overview.heights;
  Field field;
  if (!options.ply_outline) {
    field.ply = overview.reference;
    return field;
  }
  constexpr double farthest = 2000;  // points beyond the overview: of an outline of absurd size a part is enough
  const Box box = bounding_box(*options.ply_outline);
  const Eigen::Vector2d low = heights.locate(box.low), high = heights.locate(box.high);
  const auto beyond = [&](double points) { return static_cast<int>(std::ceil(std::clamp(points, 0.0, farthest))); };
  field.i0 = beyond(-low.x()), field.j0 = beyond(-low.y());
  const int nx = field.i0 + heights.nx + beyond(high.x() - (heights.nx - 1)),
            ny = field.j0 + heights.ny + beyond(high.y() - (heights.ny - 1));
  field.ply = Mask(nx, ny, heights.position(-field.i0, -field.j0), heights.spacing);
  const PlyMask ply(*options.ply_outline, field.ply);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) field.ply.at(i, j) = ply.on_ply(i, j);
  return field;
}

// Distance to the nearest marked point, in points: a chamfer of 1 and sqrt 2, at most 8 % too long.
Grid<float> distances(const Mask& marked) {
  Grid<float> out = marked.like<float>(1e6F);
  for (std::size_t k = 0; k < marked.size(); ++k)
    if (marked.values[k]) out.values[k] = 0;
  const auto relax = [&](int i, int j, int di, int dj) {
    if (!marked.contains(i + di, j + dj)) return;
    out.at(i, j) = std::min(out.at(i, j), out.at(i + di, j + dj) + (di != 0 && dj != 0 ? 1.41421356F : 1.0F));
  };
  for (int j = 0; j < marked.ny; ++j)
    for (int i = 0; i < marked.nx; ++i)
      for (const auto& [di, dj] : {std::array{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) relax(i, j, di, dj);
  for (int j = marked.ny - 1; j >= 0; --j)
    for (int i = marked.nx - 1; i >= 0; --i)
      for (const auto& [di, dj] : {std::array{1, 0}, {1, 1}, {0, 1}, {-1, 1}}) relax(i, j, di, dj);
  return out;
}

struct Component {
  UnseenHole hole;
  std::vector<Run> runs;
};

std::vector<Component> components_of(const Mask& mask) {
  const std::vector<Run> runs = find_runs(mask, true, 1);
  const std::vector<int> first = join_runs(runs, 1);
  std::vector<int> number(runs.size(), -1);
  std::vector<Component> out;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    int& n = number[static_cast<std::size_t>(first[k])];
    if (n < 0) n = static_cast<int>(out.size()), out.emplace_back();
    out[static_cast<std::size_t>(n)].runs.push_back(runs[k]);
  }
  return out;
}

// Where no height is known, and the rule for small holes would put none: a coarse pass fills nothing in.
Mask missing_in(const Grid<float>& heights, double fill_mm) {
  auto missing = heights.like<std::uint8_t>();
  for (std::size_t k = 0; k < heights.size(); ++k) missing.values[k] = std::isnan(heights.values[k]);
  for (const Component& c : components_of(missing)) {
    int left = heights.nx, right = -1;
    for (const Run& run : c.runs) left = std::min(left, run.begin), right = std::max(right, run.end - 1);
    const int low = c.runs.front().row, high = c.runs.back().row;
    const bool inside = left > 0 && low > 0 && right < heights.nx - 1 && high < heights.ny - 1;
    if (!inside || (std::max(right - left, high - low) + 1) * heights.spacing > fill_mm) continue;
    for (const Run& run : c.runs) std::fill(&missing.at(run.begin, run.row), &missing.at(run.begin, run.row) + (run.end - run.begin), 0);
  }
  return missing;
}

}  // namespace

Unseen find_unseen(const Overview& overview, const UnseenOptions& options) {
  const Field field = field_of(overview, options);
  const Mask& ply = field.ply;
  const int nx = ply.nx, ny = ply.ny;
  const double cell = ply.spacing * ply.spacing;
  const auto in_overview = [&](int i, int j) { return overview.heights.contains(i - field.i0, j - field.j0); };
  const auto height = [&](int i, int j) {
    return in_overview(i, j) ? overview.heights.at(i - field.i0, j - field.j0) : std::numeric_limits<float>::quiet_NaN();
  };
  const auto flag = [&](const Mask& mask, int i, int j) { return in_overview(i, j) && mask.at(i - field.i0, j - field.j0) != 0; };

  const Mask open = missing_in(overview.heights, options.fill_mm);
  Mask missing = ply.like<std::uint8_t>(), unmeasured = missing;
  long on = 0, with_reference = 0;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      if (!ply.at(i, j)) continue;
      ++on;
      with_reference += flag(overview.reference, i, j);
      missing.at(i, j) = !in_overview(i, j) || flag(open, i, j);
      unmeasured.at(i, j) = !flag(overview.measured, i, j);
    }

  // Measures a component; its rim are the points of the ply in `known` beside it.
  const auto measure = [&](Component& c, const Mask& known, const Grid<float>& far) {
    UnseenHole& hole = c.hole;
    hole.box = {Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()),
                Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity())};
    long count = 0, no_reference = 0;
    double deepest = 0;
    std::vector<std::size_t> rim;
    for (const Run& run : c.runs)
      for (int i = run.begin; i < run.end; ++i) {
        const Eigen::Vector2d xy = ply.position(i, run.row);
        ++count;
        hole.centre += xy;
        hole.box.low = hole.box.low.cwiseMin(xy), hole.box.high = hole.box.high.cwiseMax(xy);
        no_reference += !flag(overview.reference, i, run.row);
        deepest = std::max(deepest, static_cast<double>(far.at(i, run.row)));
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di) {
            if (!ply.contains(i + di, run.row + dj) || !ply.at(i + di, run.row + dj))
              hole.at_ply_edge = true;
            else if (known.at(i + di, run.row + dj))
              rim.push_back(ply.index(i + di, run.row + dj));
          }
      }
    std::sort(rim.begin(), rim.end());
    rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
    std::vector<float> highest;
    for (const std::size_t k : rim)
      highest.push_back(height(static_cast<int>(k % static_cast<std::size_t>(nx)), static_cast<int>(k / static_cast<std::size_t>(nx))));
    const std::size_t rank = std::clamp<std::size_t>(rim.size() / 20, 3, 8) - 1;
    if (rank < highest.size()) {
      std::nth_element(highest.begin(), highest.begin() + static_cast<long>(rank), highest.end(), std::greater<>());
      hole.rim_height = std::max(0.0F, highest[rank]);
    }
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(ply.spacing / 2);
    hole.centre /= static_cast<double>(count);
    hole.box = {hole.box.low - half, hole.box.high + half};
    hole.area = static_cast<double>(count) * cell;
    hole.thickness = 2 * std::max(0.5, std::min(deepest, 1e5) - 0.5) * ply.spacing;
    hole.reference_share = static_cast<double>(no_reference) / static_cast<double>(count);
  };

  Unseen out;
  Mask known = ply;
  for (std::size_t k = 0; k < known.size(); ++k) known.values[k] = ply.values[k] && !missing.values[k];
  Grid<float> far = distances(known);
  long lost = 0;
  for (Component& c : components_of(missing)) {
    measure(c, known, far);
    const UnseenHole& hole = c.hole;
    lost += std::lround(hole.area / cell);
    if (hole.area > options.area_tol_mm2 && hole.thickness > 2 * ply.spacing) {
      out.holes.push_back(hole);
      for (const Run& run : c.runs)  // not once more as a hole that was filled in
        for (int i = run.begin; i < run.end; ++i) unmeasured.at(i, run.row) = 0;
    } else {
      ++out.smaller;
      out.smaller_area += hole.area;
    }
  }
  const auto larger = [](const UnseenHole& a, const UnseenHole& b) { return a.area > b.area; };
  std::stable_sort(out.holes.begin(), out.holes.end(), larger);

  // Holes that were filled in. Single missing points are many and join anyhow: only where 3 by 3 are missing is a hole.
  const auto listed = static_cast<long>(out.holes.size());
  Mask core = unmeasured;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di)
          if (!unmeasured.contains(i + di, j + dj) || !unmeasured.at(i + di, j + dj)) core.at(i, j) = 0;
  Mask filled = dilate(core, 1);
  for (std::size_t k = 0; k < known.size(); ++k) known.values[k] = ply.values[k] && !unmeasured.values[k] && !missing.values[k];
  far = distances(known);
  for (Component& c : components_of(filled)) {
    measure(c, known, far);
    c.hole.filled = true;
    if (c.hole.area >= options.area_tol_mm2 / 2) out.holes.push_back(c.hole);
  }
  std::stable_sort(out.holes.begin() + listed, out.holes.end(), larger);
  if (on > 0) {
    out.coverage = static_cast<double>(on - lost) / static_cast<double>(on);
    out.reference_coverage = static_cast<double>(with_reference) / static_cast<double>(on);
  }
  return out;
}

}  // namespace debulk
