#include "debulk/cloud/grid_search.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "debulk/cloud/neighbours.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr long near_budget = 512;    // most points and cells looked at per point; a point of a sheet needs about 20
constexpr long far_budget = 20'000;  // the same for the few points that lie off the sheet
constexpr int block = 12;            // cells along the side of a block
constexpr double infinity = std::numeric_limits<double>::infinity();

// One point in `every`, by multiples of the golden ratio: evenly also among those that were seen, whatever pattern they make.
bool is_asked(std::uint32_t index, std::uint32_t every) {
  return index * 2654435769U <= std::numeric_limits<std::uint32_t>::max() / every;
}

}  // namespace

struct GridSearch::Search {
  explicit Search(int neighbours) : wanted(neighbours), squared(static_cast<std::size_t>(neighbours)) {}
  void clear() { count = 0, worst = std::numeric_limits<float>::infinity(); }
  void add(float distance) {  // distance < worst
    int k = count < wanted ? count++ : wanted - 1;
    for (; k > 0 && squared[static_cast<std::size_t>(k - 1)] > distance; --k)
      squared[static_cast<std::size_t>(k)] = squared[static_cast<std::size_t>(k - 1)];
    squared[static_cast<std::size_t>(k)] = distance;
    if (count == wanted) worst = squared.back();
  }

  int wanted;
  int count = 0;
  float worst = 0;             // squared distance below which a further point still counts
  std::vector<float> squared;  // ascending
};

GridSearch::GridSearch(const CloudView& cloud, int neighbours, int threads, const Stop& stop)
    : cloud_(cloud), neighbours_(neighbours), threads_(threads), stop_(stop) {
  choose_cells();
  sort_points();
}

// Extents are taken between quantiles of a sample, because the few points that fly or lie far away must neither
// determine the axes nor make the cells coarse. With about neighbours/2 points per cell, the neighbours of nearly
// every point are in the first ring.
void GridSearch::choose_cells() {
  std::array<std::vector<float>, 3> sample;
  const std::size_t stride = std::max<std::size_t>(1, cloud_.size() / 200'000);
  for (std::size_t i = 0; i < cloud_.size(); i += stride)
    if (cloud_.seen(i))
      for (std::size_t a = 0; a < 3; ++a) sample[a].push_back(cloud_.point(i)[a]);
  if (sample[0].empty()) return;

  std::array<double, 3> low{}, extent{};
  for (std::size_t a = 0; a < 3; ++a) {
    std::sort(sample[a].begin(), sample[a].end());
    const std::size_t last = sample[a].size() - 1, cut = last / 50;
    low[a] = sample[a][cut];
    extent[a] = sample[a][last - cut] - low[a];
    low[a] -= 0.03 * extent[a];
    extent[a] *= 1.06;
  }
  std::array<int, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return extent[static_cast<std::size_t>(a)] > extent[static_cast<std::size_t>(b)]; });
  const double points = static_cast<double>(sample[0].size()) * static_cast<double>(stride);
  const double wanted_cells = std::clamp(points / std::max(1.0, neighbours_ / 2.0), 1.0, 5e7);
  const double longer = extent[static_cast<std::size_t>(order[0])], shorter = extent[static_cast<std::size_t>(order[1])];
  if (!(longer > 0)) return;  // all in one place: one cell
  side_ = std::max(std::sqrt(longer * shorter / wanted_cells), longer / wanted_cells);
  for (int d = 0; d < 2; ++d) {
    axis_[d] = order[static_cast<std::size_t>(d)];
    low_[d] = low[static_cast<std::size_t>(axis_[d])];
    cells_[d] = std::max(1, static_cast<int>(std::ceil(extent[static_cast<std::size_t>(axis_[d])] / side_)));
  }
}

int GridSearch::cell(const float* xyz, int d) const {
  const double u = (static_cast<double>(xyz[axis_[d]]) - low_[d]) / side_;
  return static_cast<int>(std::clamp(std::floor(u), 0.0, cells_[d] - 1.0));
}

// A counting sort. The order within a cell depends on the threads; the result does not, because distances are sorted
// later.
void GridSearch::sort_points() {
  const std::size_t cells = static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]);
  std::vector<std::atomic<std::uint32_t>> next(cells + 1);
  const auto each_seen = [&](const auto& body) {
    parallel_for(static_cast<long>(cloud_.size()), 1 << 16, threads_, stop_, [&](long begin, long end) {
      for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
        const float* p = cloud_.point(i);
        if (cloud_.seen(i)) body(i, p, static_cast<std::size_t>(cell(p, 1)) * cells_[0] + cell(p, 0));
      }
    });
  };
  each_seen([&](std::size_t, const float*, std::size_t at) { next[at].fetch_add(1, std::memory_order_relaxed); });
  starts_.resize(cells + 1);
  std::uint32_t sum = 0;
  for (std::size_t c = 0; c <= cells; ++c) {
    starts_[c] = sum;
    sum += next[c].exchange(starts_[c], std::memory_order_relaxed);
  }
  entries_.resize(sum);
  each_seen([&](std::size_t i, const float* p, std::size_t at) {
    entries_[next[at].fetch_add(1, std::memory_order_relaxed)] = {{p[0], p[1], p[2]}, static_cast<std::uint32_t>(i)};
  });
}

void GridSearch::visit(const Entry& from, std::size_t begin, std::size_t end, Search& found) const {
  for (std::size_t e = begin; e < end; ++e) {
    const float distance = squared_distance(from.xyz, entries_[e].xyz);
    if (distance < found.worst && entries_[e].index != from.index) found.add(distance);
  }
}

// Calls visit_run(begin, end) on runs of entries that together are the cells of a ring. These are the cells at
// Chebyshev distance `ring` or, for ring 1, all nine.
template <class Visit>
void GridSearch::for_ring(int column, int row, int ring, const Visit& visit_run) const {
  const int first = std::max(0, column - ring), last = std::min(cells_[0] - 1, column + ring);
  for (int r = std::max(0, row - ring); r <= std::min(cells_[1] - 1, row + ring); ++r) {
    const std::uint32_t* starts = &starts_[static_cast<std::size_t>(r) * cells_[0]];
    if (ring == 1 || r == row - ring || r == row + ring) {
      visit_run(starts[first], starts[last + 1]);
    } else {
      if (column - ring >= 0) visit_run(starts[first], starts[first + 1]);
      if (column + ring < cells_[0]) visit_run(starts[last], starts[last + 1]);
    }
  }
}

// No point outside the rings is nearer than this. A side on which the rings reach the grid's border does not count,
// because no points are left there.
double GridSearch::border_distance(const Entry& from, int column, int row, int ring) const {
  double nearest = infinity;
  const int at[2] = {column, row};
  for (int d = 0; d < 2; ++d) {
    const double x = (static_cast<double>(from.xyz[axis_[d]]) - low_[d]) / side_;
    if (at[d] - ring > 0) nearest = std::min(nearest, x - (at[d] - ring));
    if (at[d] + ring + 1 < cells_[d]) nearest = std::min(nearest, at[d] + ring + 1 - x);
  }
  return nearest * side_;
}

bool GridSearch::search(std::size_t entry, int column, int row, long budget, Search& found) const {
  const Entry& from = entries_[entry];
  found.clear();
  for (int ring = 1;; ++ring) {
    for_ring(column, row, ring, [&](std::uint32_t begin, std::uint32_t end) { budget -= 1 + static_cast<long>(end - begin); });
    if (budget < 0) return false;
    for_ring(column, row, ring, [&](std::uint32_t begin, std::uint32_t end) { visit(from, begin, end, found); });
    const double border = border_distance(from, column, row, ring);
    // The factor covers the rounding of float distances. Ties need no care, because only distances matter.
    if (border == infinity || (border > 0 && found.worst <= border * border * (1 - 1e-6))) return true;
  }
}

void GridSearch::make_blocks() {
  for (int d = 0; d < 2; ++d) blocks_[d] = (cells_[d] - 1) / block + 1;
  box_.assign(static_cast<std::size_t>(blocks_[0]) * static_cast<std::size_t>(blocks_[1]), Eigen::AlignedBox3f());
  parallel_for(blocks_[1], 1, threads_, stop_, [&](long begin, long end) {
    for (int row = static_cast<int>(begin) * block; row < std::min<long>(end * block, cells_[1]); ++row)
      for (int column = 0; column < cells_[0]; ++column) {
        const std::size_t at = static_cast<std::size_t>(row) * cells_[0] + column;
        for (std::uint32_t e = starts_[at]; e < starts_[at + 1]; ++e)
          box_[static_cast<std::size_t>(row / block) * blocks_[0] + column / block].extend(
              Eigen::Map<const Eigen::Vector3f>(entries_[e].xyz));
      }
  });
}

bool GridSearch::search_blocks(std::size_t entry, int column, int row, long budget, Search& found) const {
  const Entry& from = entries_[entry];
  const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3f>(from.xyz).cast<double>();
  found.clear();
  const int middle[2] = {column / block, row / block};
  const auto visit_block = [&](int i, int j) {
    const Eigen::AlignedBox3f& box = box_[static_cast<std::size_t>(j) * blocks_[0] + i];
    --budget;
    if (box.isEmpty() || box.cast<double>().squaredExteriorDistance(p) * (1 - 1e-6) > found.worst) return;
    const int first = i * block, last = std::min(cells_[0], first + block);
    for (int r = j * block; r < std::min(cells_[1], (j + 1) * block); ++r) {
      const std::uint32_t* starts = &starts_[static_cast<std::size_t>(r) * cells_[0]];
      budget -= static_cast<long>(starts[last] - starts[first]);
      if (budget >= 0) visit(from, starts[first], starts[last], found);
    }
  };
  for (int ring = 0;; ++ring) {
    for (int j = std::max(0, middle[1] - ring); j <= std::min(blocks_[1] - 1, middle[1] + ring); ++j) {
      const int step = ring == 0 || j == middle[1] - ring || j == middle[1] + ring ? 1 : 2 * ring;
      for (int i = middle[0] - ring; i <= middle[0] + ring; i += step)
        if (i >= 0 && i < blocks_[0]) visit_block(i, j);
    }
    if (budget < 0) return false;
    // These rings of cells round the point's own cell lie within the rings of blocks.
    const int inside = std::min({column - (middle[0] - ring) * block, (middle[0] + ring + 1) * block - 1 - column,
                                 row - (middle[1] - ring) * block, (middle[1] + ring + 1) * block - 1 - row});
    const double border = border_distance(from, column, row, inside);
    if (border == infinity || (border > 0 && found.worst <= border * border * (1 - 1e-6))) return true;
  }
}

std::vector<std::uint32_t> GridSearch::mean_distances(float* means, std::uint32_t every) {
  // Rows of cells are searched in chunks. The points that a chunk leaves are collected in the order of the chunks.
  struct Left {
    std::uint32_t entry;
    int column, row;
  };
  constexpr long chunk = 4;
  std::vector<std::vector<Left>> parts(static_cast<std::size_t>((cells_[1] + chunk - 1) / chunk));
  parallel_for(cells_[1], chunk, threads_, [&](long begin, long end) {
    if (stop_.now()) throw Stopped("the search for neighbours was stopped");
    Search found(neighbours_);
    std::vector<Left>& left = parts[static_cast<std::size_t>(begin / chunk)];
    for (int row = static_cast<int>(begin); row < end; ++row)
      for (int column = 0; column < cells_[0]; ++column) {
        const std::size_t at = static_cast<std::size_t>(row) * cells_[0] + column;
        for (std::uint32_t e = starts_[at]; e < starts_[at + 1]; ++e)
          if (!is_asked(entries_[e].index, every))
            continue;
          else if (search(e, column, row, near_budget, found))
            means[entries_[e].index] = mean_distance(found.squared.data(), found.count);
          else
            left.push_back({e, column, row});
      }
  });
  std::vector<Left> left;
  for (const std::vector<Left>& part : parts) left.insert(left.end(), part.begin(), part.end());

  // If few points are left, they get a longer search. If many are, the cloud is no sheet, and a longer search of each
  // would take too long.
  std::vector<char> done(left.size(), 0);
  if (left.size() <= std::max<std::size_t>(1000, entries_.size() / 50)) {
    make_blocks();
    parallel_for(static_cast<long>(left.size()), 256, threads_, [&](long begin, long end) {
      if (stop_.now()) throw Stopped("the search for neighbours was stopped");
      Search found(neighbours_);
      for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
        if (search_blocks(left[k].entry, left[k].column, left[k].row, far_budget, found)) {
          means[entries_[left[k].entry].index] = mean_distance(found.squared.data(), found.count);
          done[k] = 1;
        }
    });
  }
  std::vector<std::uint32_t> out;
  for (std::size_t k = 0; k < left.size(); ++k)
    if (!done[k]) out.push_back(entries_[left[k].entry].index);
  return out;
}

}  // namespace debulk
