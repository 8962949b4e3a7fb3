#include "debulk/pocket/foot_contours.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/row_runs.hpp"
#include "debulk/core/simd.hpp"
#include "debulk/core/wide.hpp"
#include "debulk/pocket/components.hpp"
#include "debulk/pocket/flood_fronts.hpp"
#include "debulk/pocket/height_noise.hpp"
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

constexpr std::int32_t kNobody = -1;  // stands up, but is no pocket
constexpr double kHillShare = 0.5;    // of the cut: a hill as high as this is more than noise or a ripple
constexpr int kDi[8] = {1, -1, 0, 0, 1, 1, -1, -1};
constexpr int kDj[8] = {0, 0, 1, -1, 1, -1, 1, -1};

#define DEBULK_KERNEL "debulk/pocket/foot_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

void check(const Stop& stop) {
  if (stop.now()) throw Stopped("the search for feet was stopped");
}

// Adds a row to the sums down its columns, see ColumnSums.
DEBULK_WIDE void add_row(const float* __restrict height, const std::int32_t* __restrict label, std::size_t count, double* __restrict sum,
                         std::int32_t* __restrict known, std::int32_t* __restrict labels) {
  for (std::size_t i = 0; i < count; ++i) {
    sum[i] += height[i] == height[i] ? height[i] : 0.0F;
    known[i] += height[i] == height[i];
    labels[i] |= label[i];
  }
}

// Sums down the columns of some rows: of the known heights, of their number, and whether a pocket is there.
class ColumnSums {
 public:
  explicit ColumnSums(int nx) : sum_(static_cast<std::size_t>(nx)), known_(sum_.size()), label_(sum_.size()) {}

  void add(const float* height, const std::int32_t* label) {
    add_row(height, label, sum_.size(), sum_.data(), known_.data(), label_.data());
  }
  // Whether the mean over the columns [begin, end) is above the level, or a pocket reaches them.
  bool stand(int begin, int end, double level) const {
    double sum = 0;
    std::int32_t known = 0, label = 0;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      sum += sum_[i], known += known_[i], label |= label_[i];
    return label != 0 || sum > level * known;
  }

 private:
  std::vector<double> sum_;
  std::vector<std::int32_t> known_, label_;
};

// Where smoothing can matter: blocks of the grid whose mean is above `level` or that a pocket reaches, and two blocks
// round them.
Grid<std::uint8_t> standing(const Segmentation& segmentation, double level, double window_mm, int threads, const Stop& stop) {
  const Grid<float>& heights = segmentation.heights;
  const int nx = heights.nx, block = std::max(4, static_cast<int>(std::ceil(window_mm / (2 * heights.spacing))));
  const int bx = (nx + block - 1) / block, by = (heights.ny + block - 1) / block;
  Grid<std::uint8_t> high(bx, by, heights.origin, block * heights.spacing), active = high;
  parallel_for(by, 4, threads, stop, [&](long begin, long end) {
    for (int bj = static_cast<int>(begin); bj < end; ++bj) {
      ColumnSums columns(nx);
      for (int j = bj * block; j < std::min((bj + 1) * block, heights.ny); ++j)
        columns.add(&heights.at(0, j), &segmentation.labels.at(0, j));
      for (int bi = 0; bi < bx; ++bi) high.at(bi, bj) = columns.stand(bi * block, std::min((bi + 1) * block, nx), level);
    }
  });
  for (int j = 0; j < by; ++j)
    for (int i = 0; i < bx; ++i) {
      if (high.at(i, j) == 0) continue;
      for (int dj = -2; dj <= 2; ++dj)
        for (int di = -2; di <= 2; ++di)
          if (active.contains(i + di, j + dj)) active.at(i + di, j + dj) = 1;
    }
  auto where = heights.like<std::uint8_t>();
  for (int j = 0; j < heights.ny; ++j)
    for (int bi = 0; bi < bx; ++bi)
      if (active.at(bi, j / block)) std::fill_n(&where.at(bi * block, j), std::min(block, nx - bi * block), std::uint8_t{1});
  return where;
}

// out[i]: whether a row and the rows above and below it are all labelled at i.
void all_labelled(const std::int32_t* __restrict above, const std::int32_t* __restrict row, const std::int32_t* __restrict below, int count,
                  std::uint8_t* __restrict out) {
  for (int i = 0; i < count; ++i) out[i] = static_cast<std::uint8_t>((above[i] != 0) & (row[i] != 0) & (below[i] != 0));
}

// How many of the labels are not 0.
DEBULK_WIDE int count_labelled(const std::int32_t* label, int count) {
  int out = 0;
  for (int i = 0; i < count; ++i) out += label[i] != 0;
  return out;
}

// Runs of labelled points within some runs, whatever their labels.
std::vector<Run> labelled_runs(const Grid<std::int32_t>& labels, const Run* begin, const Run* end) {
  std::vector<Run> runs;
  for (const Run* within = begin; within != end; ++within) {
    const std::int32_t* const row = &labels.at(0, within->row);
    const int points = within->end - within->begin, labelled = count_labelled(row + within->begin, points);
    if (labelled == points) runs.push_back(*within);
    if (labelled == 0 || labelled == points) continue;  // of most runs all or none
    for (const std::int32_t *at = row + within->begin, *const last = row + within->end;;) {
      at = std::find_if(at, last, [](std::int32_t label) { return label != 0; });
      if (at == last) break;
      const std::int32_t* first = at;
      at = std::find(at, last, 0);
      runs.push_back({within->row, static_cast<int>(first - row), static_cast<int>(at - row)});
    }
  }
  return runs;
}

// Those of the labelled points with known heights that have a neighbour without a label. A flood begins at them.
std::vector<Front> rim_of(const std::vector<Run>& labelled, const Grid<std::int32_t>& labels, const Grid<float>& heights) {
  const int nx = labels.nx, ny = labels.ny;
  std::vector<Front> rim;
  // Entry i, beside a run: whether column i - 1 is labelled in the run's row and in the rows above and below it. Beyond
  // the grid everything counts as labelled.
  std::vector<std::uint8_t> column(static_cast<std::size_t>(nx) + 2, 1);
  for (const Run& run : labelled) {
    const int j = run.row, begin = std::max(run.begin - 1, 0), end = std::min(run.end + 1, nx);
    const std::int32_t *row = &labels.at(begin, j), *above = j > 0 ? row - nx : row, *below = j + 1 < ny ? row + nx : row;
    all_labelled(above, row, below, end - begin, column.data() + 1 + begin);
    for (int i = run.begin; i < run.end; ++i) {
      const std::uint8_t* c = &column[static_cast<std::size_t>(i)];
      if ((c[0] & c[1] & c[2]) != 0) continue;
      if (const float h = heights.at(i, j); !std::isnan(h)) rim.push_back({h, i, j});
    }
  }
  return rim;
}

// The least float above a bound, or not below it.
float least_above(double bound, bool bound_too) {
  const float nearest = static_cast<float>(bound);
  const bool fits = bound_too ? nearest >= bound : nearest > bound;
  return fits ? nearest : std::nextafter(nearest, std::numeric_limits<float>::infinity());
}

// Labels what stands up without being a pocket, besides the pockets; a single wild point is smoothed away and claims
// nothing. Returns the runs of all points that are labelled or that a flood may reach. No flood leaves the component of
// such points that it began in.
std::vector<Run> claim(const Segmentation& segmentation, double level, FootMap& out, int threads, const Stop& stop) {
  const Grid<std::int32_t>& given = segmentation.labels;
  out.labels.reshape(given);
  const float hill = least_above(out.hill_mm, true), higher = least_above(level, false);
  StripRuns open;
  open.clear(given.ny);
  const Isa isa = best_isa();
  parallel_for(given.ny, StripRuns::rows, threads, stop, [&](long first, long last) {
    for (int j = static_cast<int>(first); j < last; ++j) {
      RunWriter runs(open.strip(first), j);
      DEBULK_ON(isa, claim_row(&given.at(0, j), &segmentation.heights.at(0, j), &out.heights.at(0, j), given.nx, hill, higher,
                               &out.labels.at(0, j), runs));
    }
  });
  return open.join();
}

// `labels` holds the seeds, which stay; `seeds` are the runs of some. Every point above `level` that the flood from
// these reaches gets the label of the point from which it was reached.
void flood_downhill(Grid<std::int32_t>& labels, const std::vector<Run>& seeds, const Grid<float>& heights, double level, double rise,
                    const Stop& stop) {
  const int nx = labels.nx, ny = labels.ny;
  std::array<long, 8> offsets;  // of a point's neighbours, in a grid's values
  for (std::size_t k = 0; k < 8; ++k) offsets[k] = static_cast<long>(kDj[k]) * nx + kDi[k];
  const std::vector<Front> rim = rim_of(seeds, labels, heights);
  float highest = 0;
  for (const Front& front : rim) highest = std::max(highest, front.level);
  Fronts fronts(level - 1, highest);
  for (const Front& front : rim) fronts.push(front);
  Front front{};
  for (long popped = 0; fronts.pop(front); ++popped) {
    if (popped % 16384 == 0) check(stop);
    const int i = front.i, j = front.j;
    std::int32_t* const label = &labels.at(i, j);
    const float* const height = &heights.at(i, j);
    const bool interior = i > 0 && j > 0 && i + 1 < nx && j + 1 < ny;
    const double most = front.level + rise;
    if (const Front* next = fronts.next(); next != nullptr)  // a flood jumps from place to place: let its memory come meanwhile
      for (int row = std::max(0, next->j - 1); row <= std::min(ny - 1, next->j + 1); ++row)
        __builtin_prefetch(&heights.at(next->i, row)), __builtin_prefetch(&labels.at(next->i, row));
    for (std::size_t k = 0; k < 8; ++k) {
      if (!interior && !labels.contains(i + kDi[k], j + kDj[k])) continue;
      const float h = height[offsets[k]];
      if (label[offsets[k]] != 0 || !(h > level) || h > most) continue;  // unknown heights end a flood, too
      label[offsets[k]] = *label;
      fronts.push({std::min(front.level, h), i + kDi[k], j + kDj[k]});
    }
  }
}

// The smallest of the labels that are pockets' ids; 0: there is none.
DEBULK_WIDE std::int32_t smallest_id(const std::int32_t* label, int count) {
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  for (int i = 0; i < count; ++i) least = std::min(least, static_cast<std::uint32_t>(label[i]) - 1);  // what is no id comes out large
  return least < static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max()) ? static_cast<std::int32_t>(least) + 1 : 0;
}

// Where feet meet, the ply does not come down to the mold between them. They become one foot, labelled by the smallest
// of their pockets' ids. Points that stand up without being a pocket join a pocket's foot, too, or lose their label.
// `runs` are the runs of all labelled points before, and those of the feet afterwards. Returns each pocket's label.
std::vector<std::int32_t> join_feet(Grid<std::int32_t>& labels, std::vector<Run>& runs, int count) {
  std::vector<std::int32_t> label_of(static_cast<std::size_t>(count));
  RunJoining joining;
  const Components& components = joining.run(runs);
  for (std::size_t c = 0; c < static_cast<std::size_t>(components.count()); ++c) {
    std::int32_t smallest = 0;
    for (const Run* run = components.begin(c); run != components.end(c); ++run) {
      const std::int32_t id = smallest_id(&labels.at(run->begin, run->row), run->end - run->begin);
      if (id > 0 && (smallest == 0 || id < smallest)) smallest = id;
    }
    std::int32_t before = 0;
    for (const Run* run = components.begin(c); run != components.end(c); ++run)
      for (const std::int32_t *at = &labels.at(0, run->row) + run->begin, *end = at + (run->end - run->begin); at != end; ++at)
        if (const std::int32_t id = *at; id != before && id > 0) label_of[static_cast<std::size_t>(id - 1)] = smallest, before = id;
    paint(components, c, smallest, labels);
  }
  runs.erase(std::remove_if(runs.begin(), runs.end(), [&](const Run& run) { return labels.at(run.begin, run.row) == 0; }), runs.end());
  return label_of;
}

// Points that are surrounded by a single foot become part of it. `feet`: the runs of all feet.
void fill_within(Grid<std::int32_t>& labels, const std::vector<Run>& feet) {
  std::vector<Run> runs;
  complement(feet, labels.nx, labels.ny, runs);
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

FootMap find_feet(const Segmentation& segmentation, const FootOptions& options, int threads, const Stop& stop) {
  FootMap out;
  find_feet(segmentation, options, out, threads, stop);
  return out;
}

void find_feet(const Segmentation& segmentation, const FootOptions& options, FootMap& out, int threads, const Stop& stop) {
  options.check();
  check(stop);
  out.feet.clear();
  out.options = options;
  const double noise = options.noise_mm ? *options.noise_mm : height_noise(segmentation.heights);
  out.noise_mm = std::isnan(noise) ? 0 : noise;
  out.mold_tol_mm = std::max(options.mold_tol_mm, 3 * out.noise_mm);
  const double cut = segmentation.options.cut_height_mm, level = options.thickness_mm + out.mold_tol_mm;
  require(level < cut, "mold_tol_mm", "thickness + mold tolerance (at least 3 sigma of the noise) below the cut height", level);

  const auto where = standing(segmentation, options.thickness_mm + out.mold_tol_mm / 2, options.smooth_mm, threads, stop);
  smooth_heights(segmentation.heights, segmentation.ply, {options.smooth_mm}, &where, out.heights, threads, stop);
  out.hill_mm = kHillShare * cut > level ? kHillShare * cut : cut;
  const std::vector<Run> open = claim(segmentation, level, out, threads, stop);
  RunJoining joining;
  const Components& seas = joining.run(open);
  parallel_for(seas.count(), 1, threads, stop, [&](long begin, long) {
    const auto sea = static_cast<std::size_t>(begin);
    const std::vector<Run> seeds = labelled_runs(out.labels, seas.begin(sea), seas.end(sea));
    if (!seeds.empty()) flood_downhill(out.labels, seeds, out.heights, level, out.mold_tol_mm, stop);
  });
  const int count = static_cast<int>(segmentation.pockets.size());
  std::vector<Run> runs = labelled_runs(out.labels, open.data(), open.data() + open.size());
  const std::vector<std::int32_t> label_of = join_feet(out.labels, runs, count);
  check(stop);
  fill_within(out.labels, runs);
  check(stop);
  const std::vector<Outline> outlines =
      trace_outlines(labelled(out.labels, count, threads), out.labels, out.heights, level, segmentation.ply, threads, stop, false);
  for (const std::int32_t label : label_of) {
    const Outline& outline = outlines[static_cast<std::size_t>(label - 1)];
    Foot foot;
    foot.label = label;
    foot.outline = rounded(outline.polygon);
    foot.area = polygon_area(foot.outline);
    foot.box = bounding_box(foot.outline);
    foot.closed = !outline.at_unknown && !outline.at_grid_border;
    foot.touches_ply_edge = outline.at_ply_edge;
    foot.parted = outline.at_neighbour;
    out.feet.push_back(std::move(foot));
  }
}

}  // namespace debulk
