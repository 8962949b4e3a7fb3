#include "debulk/pocket/feet.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

#include "debulk/core/error.hpp"
#include "debulk/pocket/outline.hpp"
#include "debulk/pocket/smooth.hpp"

namespace debulk {

void FootOptions::check() const {
  require(std::isfinite(thickness_mm) && thickness_mm >= 0, "thickness_mm", "a length in mm, not negative", thickness_mm);
  require(std::isfinite(mold_tol_mm) && mold_tol_mm > 0, "mold_tol_mm", "a positive length in mm", mold_tol_mm);
  require(std::isfinite(smooth_mm) && smooth_mm >= 0, "smooth_mm", "a length in mm, not negative", smooth_mm);
  require(!noise_mm || (std::isfinite(*noise_mm) && *noise_mm >= 0), "noise_mm", "a length in mm, not negative", noise_mm.value_or(0));
}

namespace {

constexpr std::int32_t kNobody = -1;  // above the cut, but no pocket
constexpr int kDi[8] = {1, -1, 0, 0, 1, 1, -1, -1};
constexpr int kDj[8] = {0, 0, 1, -1, 1, -1, 1, -1};

// A point to flood on from, with the lowest height on its way.
struct Front {
  float level;
  long turn;  // first come, first served among equals
  std::size_t point;
  bool operator<(const Front& other) const { return level != other.level ? level < other.level : turn > other.turn; }
};

// Where smoothing can matter: blocks of the grid whose mean stands up, or that a pocket reaches, and two blocks round them.
Grid<std::uint8_t> standing(const Segmentation& segmentation, double level, double window_mm) {
  const Grid<float>& heights = segmentation.heights;
  const int block = std::max(4, static_cast<int>(std::ceil(window_mm / (2 * heights.spacing))));
  const int bx = (heights.nx + block - 1) / block, by = (heights.ny + block - 1) / block;
  Grid<double> sums(bx, by, heights.origin, block * heights.spacing);
  auto counts = sums.like<int>(), labelled = sums.like<int>();
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i) {
      const std::size_t b = sums.index(i / block, j / block);
      if (segmentation.labels.at(i, j) > 0) labelled.values[b] = 1;
      if (std::isnan(heights.at(i, j))) continue;
      sums.values[b] += heights.at(i, j);
      ++counts.values[b];
    }
  auto active = sums.like<std::uint8_t>();
  for (int j = 0; j < by; ++j)
    for (int i = 0; i < bx; ++i) {
      if (!labelled.at(i, j) && !(sums.at(i, j) > level * counts.at(i, j))) continue;
      for (int dj = -2; dj <= 2; ++dj)
        for (int di = -2; di <= 2; ++di)
          if (active.contains(i + di, j + dj)) active.at(i + di, j + dj) = 1;
    }
  auto where = heights.like<std::uint8_t>();
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i) where.at(i, j) = active.at(i / block, j / block);
  return where;
}

// labels: the seeds, which stay. Gives every point above `level` that is reached the label it is reached from.
void flood_downhill(Grid<std::int32_t>& labels, const Grid<float>& heights, double level, double rise) {
  std::priority_queue<Front> fronts;
  long turn = 0;
  const auto nx = static_cast<std::size_t>(labels.nx);
  for (int j = 0; j < labels.ny; ++j)
    for (int i = 0; i < labels.nx; ++i) {
      if (labels.at(i, j) == 0) continue;
      bool at_rim = false;
      for (int k = 0; k < 8; ++k) at_rim |= labels.contains(i + kDi[k], j + kDj[k]) && labels.at(i + kDi[k], j + kDj[k]) == 0;
      if (at_rim) fronts.push({heights.at(i, j), turn++, labels.index(i, j)});
    }
  while (!fronts.empty()) {
    const Front front = fronts.top();
    fronts.pop();
    const int i = static_cast<int>(front.point % nx), j = static_cast<int>(front.point / nx);
    for (int k = 0; k < 8; ++k) {
      const int qi = i + kDi[k], qj = j + kDj[k];
      if (!labels.contains(qi, qj) || labels.at(qi, qj) != 0) continue;
      const float h = heights.at(qi, qj);
      if (!(h > level) || h > front.level + rise) continue;  // unknown heights end the flood too
      labels.at(qi, qj) = labels.values[front.point];
      fronts.push({std::min(front.level, h), turn++, labels.index(qi, qj)});
    }
  }
}

// What one foot alone surrounds becomes part of it.
void fill_within(Grid<std::int32_t>& labels) {
  auto seen = labels.like<std::uint8_t>();
  std::vector<std::size_t> hole;
  const auto nx = static_cast<std::size_t>(labels.nx);
  for (std::size_t first = 0; first < labels.size(); ++first) {
    if (labels.values[first] > 0 || seen.values[first]) continue;
    hole.assign(1, first);
    seen.values[first] = 1;
    std::int32_t owner = 0;
    bool one_owner = true;
    for (std::size_t k = 0; k < hole.size(); ++k) {
      const int i = static_cast<int>(hole[k] % nx), j = static_cast<int>(hole[k] / nx);
      for (int d = 0; d < 4; ++d) {
        const int qi = i + kDi[d], qj = j + kDj[d];
        if (!labels.contains(qi, qj)) {
          one_owner = false;
          continue;
        }
        const std::int32_t label = labels.at(qi, qj);
        if (label > 0) {
          one_owner &= owner == 0 || owner == label;
          owner = label;
        } else if (const std::size_t q = labels.index(qi, qj); !seen.values[q]) {
          seen.values[q] = 1;
          hole.push_back(q);
        }
      }
    }
    if (one_owner && owner > 0)
      for (const std::size_t k : hole) labels.values[k] = owner;
  }
}

}  // namespace

FootMap find_feet(const Segmentation& segmentation, const FootOptions& options) {
  options.check();
  FootMap out;
  out.options = options;
  const double noise = options.noise_mm.value_or(height_noise(segmentation.heights));
  out.noise_mm = std::isnan(noise) ? 0 : noise;
  out.mold_tol_mm = std::max(options.mold_tol_mm, 3 * out.noise_mm);
  const double cut = segmentation.options.cut_height_mm, level = options.thickness_mm + out.mold_tol_mm;
  require(level < cut, "mold_tol_mm", "thickness + mold tolerance (at least 3 sigma of the noise) below the cut height", level);

  const auto where = standing(segmentation, options.thickness_mm + out.mold_tol_mm / 2, options.smooth_mm);
  out.heights = smooth_heights(segmentation.heights, segmentation.ply, options.smooth_mm, &where);
  out.labels = segmentation.labels;
  for (std::size_t k = 0; k < out.labels.size(); ++k)  // a single wild point is smoothed away and claims nothing
    if (out.labels.values[k] == 0 && segmentation.heights.values[k] >= cut && out.heights.values[k] >= cut) out.labels.values[k] = kNobody;
  flood_downhill(out.labels, out.heights, level, out.mold_tol_mm);
  fill_within(out.labels);
  for (std::int32_t& label : out.labels.values) label = std::max(label, 0);

  const int count = static_cast<int>(segmentation.pockets.size());
  for (Outline& outline : trace_outlines(labelled(out.labels, count), out.labels, out.heights, level, segmentation.ply)) {
    Foot foot;
    foot.outline = std::move(outline.polygon);
    foot.area = polygon_area(foot.outline);
    foot.box = bounding_box(foot.outline);
    foot.closed = !outline.at_unknown && !outline.at_grid_border;
    foot.touches_ply_edge = outline.at_ply_edge;
    foot.parted = outline.at_neighbour;
    out.feet.push_back(std::move(foot));
  }
  return out;
}

}  // namespace debulk
