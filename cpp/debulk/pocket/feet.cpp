#include "debulk/pocket/feet.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/runs.hpp"
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

void check(const Stop& stop) {
  if (stop.now()) throw Stopped("the search for feet was stopped");
}

// A point to flood on from, with the lowest height on its way.
struct Front {
  float level;
  long turn;  // first come, first served among equals
  std::size_t point;
  bool operator<(const Front& other) const { return level != other.level ? level < other.level : turn > other.turn; }
};

// The fronts, highest first. Levels only fall in a flood, so they are sorted roughly into bins as they come, and exactly when
// their bin is the highest.
class Fronts {
 public:
  Fronts(double low, double high) : low_(low), scale_(kBins / std::max(high - low, 1e-9)), bins_(kBins), at_(kBins - 1) {}

  void push(const Front& front) {
    const int bin = std::clamp(static_cast<int>((front.level - low_) * scale_), 0, at_);
    std::vector<Front>& fronts = bins_[static_cast<std::size_t>(bin)];
    fronts.push_back(front);
    if (bin == at_ && heap_) std::push_heap(fronts.begin(), fronts.end());
  }

  bool pop(Front& front) {
    while (bins_[static_cast<std::size_t>(at_)].empty()) {
      if (at_ == 0) return false;
      --at_;
      heap_ = false;
    }
    std::vector<Front>& fronts = bins_[static_cast<std::size_t>(at_)];
    if (!heap_) std::make_heap(fronts.begin(), fronts.end());
    heap_ = true;
    std::pop_heap(fronts.begin(), fronts.end());
    front = fronts.back();
    fronts.pop_back();
    return true;
  }

 private:
  static constexpr int kBins = 2048;
  double low_, scale_;
  std::vector<std::vector<Front>> bins_;
  int at_;  // no front is in a higher bin
  bool heap_ = false;
};

// Where smoothing can matter: blocks of the grid whose mean stands up, or that a pocket reaches, and two blocks round them.
Grid<std::uint8_t> standing(const Segmentation& segmentation, double level, double window_mm) {
  const Grid<float>& heights = segmentation.heights;
  const int block = std::max(4, static_cast<int>(std::ceil(window_mm / (2 * heights.spacing))));
  const int bx = (heights.nx + block - 1) / block, by = (heights.ny + block - 1) / block;
  Grid<double> sums(bx, by, heights.origin, block * heights.spacing);
  auto counts = sums.like<int>(), labelled = sums.like<int>();
  for (int j = 0; j < heights.ny; ++j)
    for (int bi = 0; bi < bx; ++bi) {
      const std::size_t b = sums.index(bi, j / block), row = heights.index(0, j);
      const float* h = &heights.values[row];
      const std::int32_t* label = &segmentation.labels.values[row];
      double sum = sums.values[b];
      int count = 0, has = 0;
      for (int i = bi * block; i < std::min(heights.nx, (bi + 1) * block); ++i) {
        has |= label[i] > 0;
        if (std::isnan(h[i])) continue;
        sum += h[i];
        ++count;
      }
      sums.values[b] = sum, counts.values[b] += count, labelled.values[b] |= has;
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
    for (int bi = 0; bi < bx; ++bi)
      if (active.at(bi, j / block)) std::fill_n(&where.at(bi * block, j), std::min(block, heights.nx - bi * block), std::uint8_t{1});
  return where;
}

// labels: the seeds, which stay. Gives every point above `level` that is reached the label it is reached from.
void flood_downhill(Grid<std::int32_t>& labels, const Grid<float>& heights, double level, double rise, const Stop& stop) {
  float highest = 0;
  for (std::size_t k = 0; k < labels.size(); ++k)
    if (labels.values[k] != 0 && heights.values[k] > highest) highest = heights.values[k];
  Fronts fronts(level - 1, highest);
  long turn = 0;
  const auto nx = static_cast<std::size_t>(labels.nx);
  for (int j = 0; j < labels.ny; ++j)
    for (int i = 0; i < labels.nx; ++i) {
      if (labels.at(i, j) == 0) continue;
      bool at_rim = false;
      for (int k = 0; k < 8; ++k) at_rim |= labels.contains(i + kDi[k], j + kDj[k]) && labels.at(i + kDi[k], j + kDj[k]) == 0;
      if (at_rim) fronts.push({heights.at(i, j), turn++, labels.index(i, j)});
    }
  Front front{};
  for (long popped = 0; fronts.pop(front); ++popped) {
    if (popped % 16384 == 0) check(stop);
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
  auto taken = labels.like<std::uint8_t>();
  for (std::size_t k = 0; k < labels.size(); ++k) taken.values[k] = labels.values[k] > 0;
  const std::vector<Run> runs = find_runs(taken, false);
  const std::vector<int> first = join_runs(runs, 0);
  constexpr std::int32_t unseen = 0, several = -1;
  std::vector<std::int32_t> owner(runs.size(), unseen);
  const auto at_border = [&](const Run& r) { return r.row == 0 || r.row == labels.ny - 1 || r.begin == 0 || r.end == labels.nx; };
  for (std::size_t k = 0; k < runs.size(); ++k)
    if (at_border(runs[k])) owner[static_cast<std::size_t>(first[k])] = several;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    std::int32_t& one = owner[static_cast<std::size_t>(first[k])];
    const auto beside = [&](int i, int j) {
      const std::int32_t label = labels.at(i, j);
      if (label > 0 && label != one) one = one == unseen ? label : several;
    };
    if (one == several) continue;
    const Run& r = runs[k];
    beside(r.begin - 1, r.row), beside(r.end, r.row);
    for (int i = r.begin; i < r.end && one != several; ++i) beside(i, r.row - 1), beside(i, r.row + 1);
  }
  for (std::size_t k = 0; k < runs.size(); ++k)
    if (const std::int32_t one = owner[static_cast<std::size_t>(first[k])]; one > 0)
      std::fill(&labels.at(runs[k].begin, runs[k].row), &labels.at(runs[k].begin, runs[k].row) + (runs[k].end - runs[k].begin), one);
}

}  // namespace

FootMap find_feet(const Segmentation& segmentation, const FootOptions& options, const Stop& stop) {
  options.check();
  check(stop);
  FootMap out;
  out.options = options;
  const double noise = options.noise_mm.value_or(height_noise(segmentation.heights));
  out.noise_mm = std::isnan(noise) ? 0 : noise;
  out.mold_tol_mm = std::max(options.mold_tol_mm, 3 * out.noise_mm);
  const double cut = segmentation.options.cut_height_mm, level = options.thickness_mm + out.mold_tol_mm;
  require(level < cut, "mold_tol_mm", "thickness + mold tolerance (at least 3 sigma of the noise) below the cut height", level);

  const auto where = standing(segmentation, options.thickness_mm + out.mold_tol_mm / 2, options.smooth_mm);
  out.heights = smooth_heights(segmentation.heights, segmentation.ply, {options.smooth_mm}, &where, stop);
  out.labels = segmentation.labels;
  for (std::size_t k = 0; k < out.labels.size(); ++k)  // a single wild point is smoothed away and claims nothing
    if (out.labels.values[k] == 0 && segmentation.heights.values[k] >= cut && out.heights.values[k] >= cut) out.labels.values[k] = kNobody;
  check(stop);
  flood_downhill(out.labels, out.heights, level, out.mold_tol_mm, stop);
  check(stop);
  fill_within(out.labels);
  for (std::int32_t& label : out.labels.values) label = std::max(label, 0);

  const int count = static_cast<int>(segmentation.pockets.size());
  for (Outline& outline : trace_outlines(labelled(out.labels, count), out.labels, out.heights, level, segmentation.ply)) {
    Foot foot;
    foot.outline = rounded(std::move(outline.polygon));
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
