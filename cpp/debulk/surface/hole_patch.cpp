#include "debulk/surface/hole_patch.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr Cell around[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};

// Grows the marks in an image of `nx` columns, but not onto its border, by layer number `layer`: over corners and
// edges if that is odd, over edges only if it is even. The two in turn keep a disc round.
void grow(std::vector<std::uint8_t>& marks, std::vector<std::uint8_t>& scratch, int nx, int layer) {
  scratch = marks;
  const std::uint8_t* from = scratch.data();
  std::uint8_t* to = marks.data();
  const long size = static_cast<long>(marks.size());
  for (long k = nx + 1; k < size - nx - 1; ++k) to[k] |= from[k - 1] | from[k + 1] | from[k - nx] | from[k + nx];
  if (layer % 2 == 0) return;
  for (long k = nx + 1; k < size - nx - 1; ++k) to[k] |= from[k - nx - 1] | from[k - nx + 1] | from[k + nx - 1] | from[k + nx + 1];
}

#define DEBULK_KERNEL "debulk/surface/band_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

// Solves A x = b for a positive definite A (see band_kernel.inl). Both are overwritten.
void solve_band(std::vector<double>& band, int width, int stride, std::vector<double>& b, const Stop& stop) {
  const int count = static_cast<int>(b.size());
  constexpr long most = 20'000'000;  // products between two checks of the stop: some milliseconds
  const int columns = static_cast<int>(std::max(1L, most / std::max(1L, static_cast<long>(width) * width)));
  for (int first = 0; first < count; first += columns) {
    if (stop.now()) throw Stopped("the filling of a hole was stopped");
    const int end = std::min(count, first + columns);
    DEBULK_ON(best_isa(), factor(band.data(), width, stride, b.data(), count, first, end));
  }
  for (int j = count - 1; j >= 0; --j) {
    const double* from = &band[static_cast<std::size_t>(j) * static_cast<std::size_t>(stride)];
    double sum = b[static_cast<std::size_t>(j)];
    for (int d = 1; d <= std::min(width, count - 1 - j); ++d) sum -= from[d] * b[static_cast<std::size_t>(j + d)];
    b[static_cast<std::size_t>(j)] = sum / from[0];
  }
}

}  // namespace

void HolePatch::surround(const Grid<float>& heights, const Hole& hole) {
  const int widest = std::max(3, (hole.width() + 1) / 2), margin = widest + 1;
  left_ = hole.left - margin, top_ = hole.low - margin, nx_ = hole.right - hole.left + 1 + 2 * margin;
  const int ny = hole.high - hole.low + 1 + 2 * margin;
  number_.assign(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny), -1);
  marks_.assign(number_.size(), 0);
  for (int k = 0; k < hole.count; ++k) number_[at(hole.cells[k])] = k, marks_[at(hole.cells[k])] = 1;
  const int layers = std::min(widest, std::max(3, (3 * depth() + 2) / 4));
  for (int l = 1; l <= layers; ++l) grow(marks_, scratch_, nx_, l);
  ring_.clear();
  for (int j = std::max(0, top_); j < std::min(heights.ny, top_ + ny); ++j)
    for (int i = std::max(0, left_); i < std::min(heights.nx, left_ + nx_); ++i) {
      if (marks_[at({i, j})] == 0 || number_[at({i, j})] >= 0) continue;
      const float z = heights.at(i, j);
      if (!std::isnan(z)) ring_.push_back({static_cast<double>(i), static_cast<double>(j), z});
    }
}

// Number of cells from the rim to the hole's deepest point.
int HolePatch::depth() {
  outside_.resize(marks_.size());
  std::transform(marks_.begin(), marks_.end(), outside_.begin(), [](std::uint8_t inside) { return static_cast<std::uint8_t>(1 - inside); });
  int layer = 0;
  while (std::find(outside_.begin(), outside_.end(), 0) != outside_.end()) grow(outside_, scratch_, nx_, ++layer);
  return layer;
}

// Solves the five-point Laplace equation for the trend's residuals at the rim; the result is rest_. The region is a
// whole component, so all missing neighbours of its cells are its own cells.
void HolePatch::harmonic(const Grid<float>& heights, const Hole& hole, const RingFit& trend, const Stop& stop) {
  int width = 0;
  for (int k = 0; k < hole.count; ++k)
    for (int s = 0; s < 2; ++s) width = std::max(width, number_[at({hole.cells[k].i + around[s].i, hole.cells[k].j + around[s].j})] - k);
  const int stride = width + 9;
  band_.assign(static_cast<std::size_t>(hole.count) * static_cast<std::size_t>(stride), 0.0);
  rest_.assign(static_cast<std::size_t>(hole.count), 0.0);
  for (int k = 0; k < hole.count; ++k) {
    double* column = &band_[static_cast<std::size_t>(k) * static_cast<std::size_t>(stride)];
    column[0] = 4;
    for (int s = 0; s < 4; ++s) {
      const Cell b{hole.cells[k].i + around[s].i, hole.cells[k].j + around[s].j};
      const int other = number_[at(b)];
      if (other > k) column[other - k] = -1;
      if (other < 0) rest_[static_cast<std::size_t>(k)] += heights.at(b.i, b.j) - trend(b.i, b.j);
    }
  }
  solve_band(band_, width, stride, rest_, stop);
}

void HolePatch::fill(const Grid<float>& heights, const Hole& hole, float* out, const Stop& stop) {
  surround(heights, hole);
  inside_.clear();
  for (int k = 0; k < hole.count; ++k) inside_.push_back({static_cast<double>(hole.cells[k].i), static_cast<double>(hole.cells[k].j), 0});
  const RingFit trend(ring_, inside_, hole.width() <= 3 ? 2 : 4);
  harmonic(heights, hole, trend, stop);
  for (std::size_t k = 0; k < inside_.size(); ++k) out[k] = static_cast<float>(trend(inside_[k].x, inside_[k].y) + rest_[k]);
}

}  // namespace debulk
