#include "debulk/surface/hole_patch.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

// The four over edges come first.
constexpr Cell around[8] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}};

// Growing over edges and corners in turn keeps a disc round.
constexpr int reach(int layer) {
  return layer % 2 ? 8 : 4;
}

// Solves A x = b for a positive definite A of which band[j * (width + 1) + d] is A(j + d, j); overwrites both.
void solve_band(std::vector<double>& band, int width, std::vector<double>& b) {
  const int count = static_cast<int>(b.size());
  const auto column = [&](int j) { return &band[static_cast<std::size_t>(j) * static_cast<std::size_t>(width + 1)]; };
  const auto rhs = [&](int j) -> double& { return b[static_cast<std::size_t>(j)]; };
  for (int j = 0; j < count; ++j) {  // L D Lᵀ
    const double* from = column(j);
    const double inverse = 1 / from[0];
    const int last = std::min(width, count - 1 - j);
    for (int d = 1; d <= last; ++d) {
      const double factor = from[d] * inverse;
      if (factor == 0) continue;
      double* to = column(j + d);
      for (int e = d; e <= last; ++e) to[e - d] -= factor * from[e];
      rhs(j + d) -= factor * rhs(j);
    }
  }
  for (int j = count - 1; j >= 0; --j) {
    const double* from = column(j);
    double sum = rhs(j);
    for (int d = 1; d <= std::min(width, count - 1 - j); ++d) sum -= from[d] * rhs(j + d);
    rhs(j) = sum / from[0];
  }
}

}  // namespace

void HolePatch::surround(const Grid<float>& heights, const Hole& hole) {
  const int margin = std::max(3, (hole.width() + 1) / 2);
  left_ = hole.left - margin, top_ = hole.low - margin, nx_ = hole.right - hole.left + 1 + 2 * margin;
  layer_.assign(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(hole.high - hole.low + 1 + 2 * margin), -1);
  number_.assign(layer_.size(), -1);
  for (int k = 0; k < hole.count; ++k) layer_[at(hole.cells[k])] = 0, number_[at(hole.cells[k])] = k;
  const int layers = std::min(margin, std::max(3, (3 * depth(hole) + 2) / 4));
  front_.assign(hole.cells, hole.cells + hole.count);
  ring_.clear();
  for (int l = 1; l <= layers; ++l) {
    next_.clear();
    for (const Cell& c : front_)
      for (int s = 0; s < reach(l); ++s) {
        const Cell beside{c.i + around[s].i, c.j + around[s].j};
        if (!heights.contains(beside.i, beside.j) || layer_[at(beside)] >= 0) continue;
        layer_[at(beside)] = l;
        next_.push_back(beside);
        const float z = heights.at(beside.i, beside.j);
        if (!std::isnan(z)) ring_.push_back({static_cast<double>(beside.i), static_cast<double>(beside.j), z});
      }
    front_.swap(next_);
  }
}

// Cells from the rim to the hole's deepest point.
int HolePatch::depth(const Hole& hole) {
  deep_.assign(static_cast<std::size_t>(hole.count), 0);
  front_.clear();
  const auto beside = [&](const Cell& c, int layer, const auto& visit) {
    for (int s = 0; s < reach(layer); ++s) visit(number_[at({c.i + around[s].i, c.j + around[s].j})]);
  };
  for (int k = 0; k < hole.count; ++k) {
    bool rim = false;
    beside(hole.cells[k], 1, [&](int other) { rim |= other < 0; });
    if (rim) deep_[static_cast<std::size_t>(k)] = 1, front_.push_back(hole.cells[k]);
  }
  int deepest = 1;
  for (; !front_.empty(); ++deepest) {
    next_.clear();
    for (const Cell& c : front_)
      beside(c, deepest + 1, [&](int k) {
        if (k < 0 || deep_[static_cast<std::size_t>(k)] > 0) return;
        deep_[static_cast<std::size_t>(k)] = deepest + 1;
        next_.push_back(hole.cells[k]);
      });
    front_.swap(next_);
  }
  return deepest - 1;
}

// The five-point Laplace equation for what the trend leaves at the rim, into rest_. The region has no missing neighbours
// but its own cells, since it is a whole connected one.
void HolePatch::harmonic(const Grid<float>& heights, const Hole& hole, const RingFit& trend) {
  int width = 0;
  for (int k = 0; k < hole.count; ++k)
    for (int s = 0; s < 2; ++s) width = std::max(width, number_[at({hole.cells[k].i + around[s].i, hole.cells[k].j + around[s].j})] - k);
  band_.assign(static_cast<std::size_t>(hole.count) * static_cast<std::size_t>(width + 1), 0.0);
  rest_.assign(static_cast<std::size_t>(hole.count), 0.0);
  for (int k = 0; k < hole.count; ++k) {
    double* column = &band_[static_cast<std::size_t>(k) * static_cast<std::size_t>(width + 1)];
    column[0] = 4;
    for (int s = 0; s < 4; ++s) {
      const Cell b{hole.cells[k].i + around[s].i, hole.cells[k].j + around[s].j};
      const int other = number_[at(b)];
      if (other > k) column[other - k] = -1;
      if (other < 0) rest_[static_cast<std::size_t>(k)] += heights.at(b.i, b.j) - trend(b.i, b.j);
    }
  }
  solve_band(band_, width, rest_);
}

void HolePatch::fill(const Grid<float>& heights, const Hole& hole, float* out) {
  surround(heights, hole);
  inside_.clear();
  for (int k = 0; k < hole.count; ++k) inside_.push_back({static_cast<double>(hole.cells[k].i), static_cast<double>(hole.cells[k].j), 0});
  const RingFit trend(ring_, inside_, hole.width() <= 3 ? 2 : 4);
  harmonic(heights, hole, trend);
  for (std::size_t k = 0; k < inside_.size(); ++k) out[k] = static_cast<float>(trend(inside_[k].x, inside_[k].y) + rest_[k]);
}

}  // namespace debulk
