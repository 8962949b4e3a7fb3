#include "debulk/pocket/unseen.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "debulk/core/row_runs.hpp"
#include "debulk/pocket/dilate.hpp"
#include "debulk/pocket/ply_mask.hpp"

namespace debulk {
namespace {

using Mask = Grid<std::uint8_t>;
constexpr float nowhere = 1e6F;  // farther than any point, in points

// The overview's points, and as many more round them as the outline reaches.
struct Field {
  int i0 = 0, j0 = 0;  // position of the overview in this grid
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
  for (int j = 0; j < ny; ++j) std::copy(ply.row(j), ply.row(j) + nx, &field.ply.at(0, j));
  return field;
}

struct Component {
  UnseenHole hole;
  std::vector<Run> runs;

  long count() const {
    long out = 0;
    for (const Run& run : runs) out += run.end - run.begin;
    return out;
  }

  // A place itself if it lies in the component, else the component's nearest point.
  Eigen::Vector2d nearest(const Mask& grid, const Eigen::Vector2d& place) const {
    Eigen::Vector2d best = place;
    double least = std::numeric_limits<double>::infinity();
    for (const Run& run : runs)
      for (int i = run.begin; i < run.end; ++i) {
        const Eigen::Vector2d away = grid.position(i, run.row) - place;
        if (away.cwiseAbs().maxCoeff() <= grid.spacing / 2) return place;
        if (away.squaredNorm() < least) least = away.squaredNorm(), best = place + away;
      }
    return best;
  }
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

// The points [i0, i1) x [j0, j1).
struct Part {
  int i0, j0, i1, j1;
};

// Distance of a component's farthest point to the nearest marked one in a part of the grid, in points. It is a chamfer
// distance with steps of 1 and sqrt 2, at most 8 % too long.
double depth_in(const Part& part, const Component& c, const Mask& marked) {
  const int nx = part.i1 - part.i0 + 2, ny = part.j1 - part.j0 + 2;  // with a border, so that every point has neighbours
  std::vector<float> far(static_cast<std::size_t>(nx) * ny, nowhere);
  for (int j = part.j0; j < part.j1; ++j) {
    float* row = &far[static_cast<std::size_t>(j - part.j0 + 1) * nx + 1];
    for (int i = part.i0; i < part.i1; ++i)
      if (marked.at(i, j)) row[i - part.i0] = 0;
  }
  constexpr float diagonal = 1.41421356F;
  const auto relax = [&](int first, int step) {  // from three neighbours in the row before, and the one before
    for (int y = 1; y < ny - 1; ++y) {
      float* at = &far[static_cast<std::size_t>(step > 0 ? y : ny - 1 - y) * nx + first];
      const float* before = at - step * nx;
      for (int x = 1; x < nx - 1; ++x, at += step, before += step)
        *at = std::min({*at, at[-step] + 1, before[0] + 1, before[-1] + diagonal, before[1] + diagonal});
    }
  };
  relax(1, 1);
  relax(nx - 2, -1);
  float deepest = 0;
  for (const Run& run : c.runs) {
    const float* first = &far[static_cast<std::size_t>(run.row - part.j0 + 1) * nx + (run.begin - part.i0 + 1)];
    deepest = std::max(deepest, *std::max_element(first, first + (run.end - run.begin)));
  }
  return deepest;
}

// The same in the whole grid. Points farther away than the nearest one found so far need not be looked at.
double depth_of(const Component& c, const Mask& marked) {
  const auto grown = [&](int reach) {
    Part part{marked.nx, std::max(0, c.runs.front().row - reach), 0, std::min(marked.ny, c.runs.back().row + 1 + reach)};
    for (const Run& run : c.runs) part.i0 = std::min(part.i0, run.begin - reach), part.i1 = std::max(part.i1, run.end + reach);
    return Part{std::max(0, part.i0), part.j0, std::min(marked.nx, part.i1), part.j1};
  };
  const double found = depth_in(grown(1), c, marked);
  if (found < 2) return found;
  return depth_in(grown(static_cast<int>(std::min<double>(std::ceil(found), marked.nx + marked.ny))), c, marked);
}

// The height that a twentieth of a rim's points reach; see UnseenHole.
double height_of(std::vector<float> rim) {
  const std::size_t rank = std::clamp<std::size_t>(rim.size() / 20, 3, 8) - 1;
  if (rank >= rim.size()) return 0;
  std::nth_element(rim.begin(), rim.begin() + static_cast<long>(rank), rim.end(), std::greater<>());
  return std::max(0.0F, rim[rank]);
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

  Mask missing = ply.like<std::uint8_t>(), unmeasured = missing;
  long on = 0, with_reference = 0;
  for (int j = 0; j < ny; ++j) {
    const std::uint8_t* on_ply = &ply.at(0, j);
    std::uint8_t *no_height = &missing.at(0, j), *no_point = &unmeasured.at(0, j);
    std::copy(on_ply, on_ply + nx, no_height);
    std::copy(on_ply, on_ply + nx, no_point);
    on += std::accumulate(on_ply, on_ply + nx, 0);
    if (!in_overview(field.i0, j)) continue;
    const std::size_t row = overview.heights.index(0, j - field.j0);
    const float* heights = &overview.heights.values[row];
    const std::uint8_t *measured = &overview.measured.values[row], *reference = &overview.reference.values[row];
    on_ply += field.i0, no_height += field.i0, no_point += field.i0;
    int known = 0;
    for (int i = 0; i < overview.heights.nx; ++i) {
      known += on_ply[i] & (reference[i] != 0);
      no_height[i] &= std::isnan(heights[i]);
      no_point[i] &= measured[i] == 0;
    }
    with_reference += known;
  }

  // Measures a component. Its rim is made up of the ply's points in `known` beside it.
  const auto measure = [&](Component& c, const Mask& known) {
    UnseenHole& hole = c.hole;
    hole.box = {Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()),
                Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity())};
    const long count = c.count();
    long no_reference = 0;
    std::vector<std::size_t> rim;
    for (const Run& run : c.runs)
      for (int i = run.begin; i < run.end; ++i) {
        const Eigen::Vector2d xy = ply.position(i, run.row);
        hole.centre += xy;
        hole.box.low = hole.box.low.cwiseMin(xy), hole.box.high = hole.box.high.cwiseMax(xy);
        no_reference += !flag(overview.reference, i, run.row);
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
    std::vector<float> heights;
    for (const std::size_t k : rim)
      heights.push_back(height(static_cast<int>(k % static_cast<std::size_t>(nx)), static_cast<int>(k / static_cast<std::size_t>(nx))));
    hole.rim_height = height_of(std::move(heights));
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(ply.spacing / 2);
    hole.centre = c.nearest(ply, hole.centre / static_cast<double>(count));
    hole.box = {hole.box.low - half, hole.box.high + half};
    hole.area = static_cast<double>(count) * cell;
    hole.thickness = 2 * std::min(depth_of(c, known), 1e5) * ply.spacing;
    hole.reference_share = static_cast<double>(no_reference) / static_cast<double>(count);
  };

  Unseen out;
  Mask known = ply;
  for (std::size_t k = 0; k < known.size(); ++k) known.values[k] &= missing.values[k] == 0;
  long lost = 0;
  for (Component& c : components_of(missing)) {
    const auto area = static_cast<double>(c.count()) * cell;
    lost += c.count();
    if (area > options.area_tol_mm2) measure(c, known);  // most are small
    if (c.hole.thickness > 3 * ply.spacing) {
      out.holes.push_back(c.hole);
      for (const Run& run : c.runs)  // so that it is not listed again as a hole that was filled in
        for (int i = run.begin; i < run.end; ++i) unmeasured.at(i, run.row) = 0;
    } else {
      ++out.smaller;
      out.smaller_area += area;
    }
  }
  const auto larger = [](const UnseenHole& a, const UnseenHole& b) { return a.area > b.area; };
  std::stable_sort(out.holes.begin(), out.holes.end(), larger);

  // Holes that were filled in. Single missing points are many and would join, so only where 3 by 3 are missing is a
  // hole.
  const auto listed = static_cast<long>(out.holes.size());
  Mask core = ply.like<std::uint8_t>();
  for (const Run& run : find_runs(unmeasured, true, 1)) {
    if (run.row == 0 || run.row == ny - 1) continue;
    for (int i = run.begin + 1; i < run.end - 1; ++i) {
      const std::uint8_t *low = &unmeasured.at(i, run.row - 1), *high = &unmeasured.at(i, run.row + 1);
      core.at(i, run.row) = low[-1] & low[0] & low[1] & high[-1] & high[0] & high[1];
    }
  }
  const Mask filled = dilate(core, 1);
  for (std::size_t k = 0; k < known.size(); ++k) known.values[k] &= unmeasured.values[k] == 0;
  for (Component& c : components_of(filled)) {
    if (static_cast<double>(c.count()) * cell < options.area_tol_mm2 / 2) continue;
    measure(c, known);
    c.hole.thickness -= ply.spacing;  // its heights are those that its rim leads to
    c.hole.filled = true;
    out.holes.push_back(c.hole);
  }
  std::stable_sort(out.holes.begin() + listed, out.holes.end(), larger);
  if (on > 0) {
    out.coverage = static_cast<double>(on - lost) / static_cast<double>(on);
    out.reference_coverage = static_cast<double>(with_reference) / static_cast<double>(on);
  }
  return out;
}

}  // namespace debulk
