#include "debulk/surface/fill_holes.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/SparseCholesky>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/runs.hpp"
#include "debulk/surface/ring_fit.hpp"

namespace debulk {
namespace {

struct Cell {
  int i, j;
};

struct Hole {
  std::vector<Cell> cells;
  int left, right, low, high;
  int width() const { return std::max(right - left, high - low) + 1; }
};

// The four over edges come first.
constexpr Cell around[8] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}};

// The missing regions that are to be filled, in the order of their first cells.
std::vector<Hole> find_holes(const Grid<float>& heights, double diameter, const Grid<std::uint8_t>& there, int threads) {
  const std::vector<Run> runs = find_runs(there, false, threads);
  const std::vector<int> first = join_runs(runs, 1);
  std::vector<Hole> regions(runs.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Run& run = runs[k];
    Hole& region = regions[static_cast<std::size_t>(first[k])];
    if (static_cast<std::size_t>(first[k]) == k) region = {{}, run.begin, run.end - 1, run.row, run.row};
    region.left = std::min(region.left, run.begin), region.right = std::max(region.right, run.end - 1);
    region.high = run.row;
  }
  const auto wanted = [&](const Hole& h) {
    const bool inside = h.left > 0 && h.low > 0 && h.right < heights.nx - 1 && h.high < heights.ny - 1;
    return inside && h.width() * heights.spacing <= diameter;
  };
  for (std::size_t k = 0; k < runs.size(); ++k) {
    Hole& region = regions[static_cast<std::size_t>(first[k])];
    if (wanted(region))
      for (int i = runs[k].begin; i < runs[k].end; ++i) region.cells.push_back({i, runs[k].row});
  }
  std::vector<Hole> holes;
  for (Hole& region : regions)
    if (!region.cells.empty()) holes.push_back(std::move(region));
  return holes;
}

// A hole with its surroundings, `margin` cells on each side. Layers: 0 in the hole, 1 at its rim, 2 ...; -1 farther.
class Patch {
 public:
  Patch(const Grid<float>& heights, const Hole& hole) : heights_(heights), hole_(hole), margin_(std::max(3, (hole.width() + 1) / 2)) {
    nx_ = hole.right - hole.left + 1 + 2 * margin_;
    layer_.assign(static_cast<std::size_t>(nx_) * (hole.high - hole.low + 1 + 2 * margin_), -1);
    number_.assign(layer_.size(), -1);
    std::vector<Cell> front = hole.cells;
    for (std::size_t k = 0; k < hole.cells.size(); ++k) layer(hole.cells[k]) = 0, number(hole.cells[k]) = static_cast<int>(k);
    const int layers = std::max(3, (3 * depth() + 2) / 4);
    for (int l = 1; l <= std::min(layers, margin_); ++l) {
      std::vector<Cell> next;
      for (const Cell& c : front)
        for (int s = 0; s < reach(l); ++s) {
          const Cell beside{c.i + around[s].i, c.j + around[s].j};
          if (!heights.contains(beside.i, beside.j) || layer(beside) >= 0) continue;
          layer(beside) = l;
          next.push_back(beside);
          const float z = heights.at(beside.i, beside.j);
          if (!std::isnan(z)) ring_.push_back({static_cast<double>(beside.i), static_cast<double>(beside.j), z});
        }
      front.swap(next);
    }
  }

  std::vector<float> fill() {
    std::vector<RingPoint> inside;
    for (const Cell& c : hole_.cells) inside.push_back({static_cast<double>(c.i), static_cast<double>(c.j), 0});
    const RingFit trend(ring_, inside, hole_.width() <= 3 ? 2 : 4);
    const Eigen::VectorXd rest = harmonic(trend);
    std::vector<float> out;
    for (std::size_t k = 0; k < hole_.cells.size(); ++k)
      out.push_back(static_cast<float>(trend(inside[k].x, inside[k].y) + rest[static_cast<Eigen::Index>(k)]));
    return out;
  }

 private:
  std::size_t at(const Cell& c) const { return static_cast<std::size_t>(c.j - hole_.low + margin_) * nx_ + (c.i - hole_.left + margin_); }
  int& layer(const Cell& c) { return layer_[at(c)]; }
  int& number(const Cell& c) { return number_[at(c)]; }

  // Growing over edges and corners in turn keeps a disc round.
  static int reach(int layer) { return layer % 2 ? 8 : 4; }

  // Cells from the rim to the hole's deepest point.
  int depth() {
    std::vector<int> deep(hole_.cells.size(), 0);
    std::vector<Cell> front;
    const auto beside = [&](const Cell& c, int layer, const auto& visit) {
      for (int s = 0; s < reach(layer); ++s) visit(number({c.i + around[s].i, c.j + around[s].j}));
    };
    for (const Cell& c : hole_.cells) {
      bool rim = false;
      beside(c, 1, [&](int k) { rim |= k < 0; });
      if (rim) deep[static_cast<std::size_t>(number(c))] = 1, front.push_back(c);
    }
    int deepest = 1;
    for (; !front.empty(); ++deepest) {
      std::vector<Cell> next;
      for (const Cell& c : front)
        beside(c, deepest + 1, [&](int k) {
          if (k < 0 || deep[static_cast<std::size_t>(k)] > 0) return;
          deep[static_cast<std::size_t>(k)] = deepest + 1;
          next.push_back(hole_.cells[static_cast<std::size_t>(k)]);
        });
      front.swap(next);
    }
    return deepest - 1;
  }

  // Solves the five-point Laplace equation for what the trend leaves at the rim. The region has no missing neighbours
  // but its own cells, since it is a whole connected one.
  Eigen::VectorXd harmonic(const RingFit& trend) {
    const auto count = static_cast<Eigen::Index>(hole_.cells.size());
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const Cell c = hole_.cells[static_cast<std::size_t>(k)];
      entries.emplace_back(k, k, 4.0);
      for (int s = 0; s < 4; ++s) {
        const Cell b{c.i + around[s].i, c.j + around[s].j};
        const int other = number(b);
        if (other >= 0)
          entries.emplace_back(k, other, -1.0);
        else
          right[k] += heights_.at(b.i, b.j) - trend(b.i, b.j);
      }
    }
    if (count == 1) return right / 4;
    Eigen::SparseMatrix<double> laplace(count, count);
    laplace.setFromTriplets(entries.begin(), entries.end());
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(laplace).solve(right);
  }

  const Grid<float>& heights_;
  const Hole& hole_;
  int margin_, nx_ = 0;
  std::vector<int> layer_, number_;
  std::vector<RingPoint> ring_;
};

}  // namespace

void FillOptions::check() const {
  require(std::isfinite(diameter) && diameter >= 0, "hole_diameter_mm", "a length in mm, or 0 to fill nothing", diameter);
}

void fill_holes(Grid<float>& heights, const FillOptions& options, Grid<std::uint8_t>& measured, int threads) {
  options.check();
  measured.nx = heights.nx, measured.ny = heights.ny, measured.origin = heights.origin, measured.spacing = heights.spacing;
  measured.values.resize(heights.size());
  parallel_for(static_cast<long>(heights.size()), 1 << 17, threads, [&](long begin, long end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
      measured.values[k] = heights.values[k] == heights.values[k];
  });
  const std::vector<Hole> holes = find_holes(heights, options.diameter, measured, threads);
  std::vector<std::vector<float>> fillings(holes.size());
  parallel_for(static_cast<long>(holes.size()), 16, threads, [&](long begin, long end) {
    for (auto h = static_cast<std::size_t>(begin); h < static_cast<std::size_t>(end); ++h) fillings[h] = Patch(heights, holes[h]).fill();
  });
  for (std::size_t h = 0; h < holes.size(); ++h)  // only now: every ring is of measured values
    for (std::size_t k = 0; k < holes[h].cells.size(); ++k) heights.at(holes[h].cells[k].i, holes[h].cells[k].j) = fillings[h][k];
}

Grid<std::uint8_t> fill_holes(Grid<float>& heights, const FillOptions& options, int threads) {
  Grid<std::uint8_t> measured;
  fill_holes(heights, options, measured, threads);
  return measured;
}

}  // namespace debulk
