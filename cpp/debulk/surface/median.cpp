#include "debulk/surface/median.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

#define DEBULK_KERNEL "debulk/surface/median_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

// The median of the known values at columns and rows `step` apart, up to `reach` steps away.
float window_median(const Grid<float>& grid, int i, int j, int reach, int step) {
  if (std::isnan(grid.at(i, j))) return std::numeric_limits<float>::quiet_NaN();
  std::array<float, 25> window{};
  auto last = window.begin();
  for (int y = j - reach * step; y <= j + reach * step; y += step)
    for (int x = i - reach * step; x <= i + reach * step; x += step)
      if (grid.contains(x, y) && !std::isnan(grid.at(x, y))) *last++ = grid.at(x, y);
  const auto middle = window.begin() + (last - window.begin()) / 2;
  std::nth_element(window.begin(), middle, last);
  return (last - window.begin()) % 2 == 0 ? (*middle + *std::max_element(window.begin(), middle)) / 2 : *middle;
}

// By how much the eight values `step` apart differ, without the highest and the lowest; 0 if half of them are unknown.
float relief(const Grid<float>& grid, int i, int j, int step) {
  std::array<float, 8> round{};
  auto last = round.begin();
  for (int y = j - step; y <= j + step; y += step)
    for (int x = i - step; x <= i + step; x += step)
      if ((x != i || y != j) && grid.contains(x, y) && !std::isnan(grid.at(x, y))) *last++ = grid.at(x, y);
  if (last - round.begin() <= 4) return 0;
  std::nth_element(round.begin(), round.begin() + 1, last);
  const float low = round[1];
  std::nth_element(round.begin(), last - 2, last);
  return *(last - 2) - low;
}

// Whether 3 by 3 known values that hold this one stand off its median as it does, by a quarter as much at least.
bool stands(const Grid<float>& grid, int i, int j, float median) {
  const float off = grid.at(i, j) - median;
  for (int dy = -2; dy <= 0; ++dy)
    for (int dx = -2; dx <= 0; ++dx) {
      float least = infinity;
      for (int y = std::max(0, j + dy); y <= std::min(grid.ny - 1, j + dy + 2); ++y)
        for (int x = std::max(0, i + dx); x <= std::min(grid.nx - 1, i + dx + 2); ++x)
          least = std::fmin(least, (grid.at(x, y) - median) / off);  // of missing ones nothing is known
      if (least >= 0.25F) return true;
    }
  return false;
}

// Replaces values farther than the tolerance from their medians by these. If what stands is spared, the tolerance is wider
// by the relief round the value.
void filter(const Grid<float>& grid, int reach, int step, float tolerance, bool spared, Grid<float>& out, int threads, const Stop& stop) {
  out.nx = grid.nx, out.ny = grid.ny, out.origin = grid.origin, out.spacing = grid.spacing;
  out.values.resize(grid.size());
  const Isa isa = best_isa();
  parallel_for(grid.ny, 32, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j) {
      const auto slow = [&](int i) {
        const float found = window_median(grid, i, j, reach, step), value = grid.at(i, j);
        out.at(i, j) = std::abs(value - found) > tolerance ? found : value;
      };
      int done = std::min(step, grid.nx);
      for (int i = 0; i < done; ++i) slow(i);
      if (reach == 1 && j >= step && j + step < grid.ny)
        done = DEBULK_ON(isa,
                         run(step, &grid.at(0, j - step), &grid.at(0, j), &grid.at(0, j + step), done, grid.nx, tolerance, &out.at(0, j)));
      for (int i = done; i < grid.nx; ++i) slow(i);
      for (int i = 0; spared && i < grid.nx; ++i) {
        const float value = grid.at(i, j), middle = out.at(i, j), off = std::abs(value - middle);
        if (off > 0 && off <= tolerance + relief(grid, i, j, step) && stands(grid, i, j, middle)) out.at(i, j) = value;
      }
    }
  });
}

}  // namespace

void median(const Grid<float>& grid, int size, Grid<float>& out, int threads, const Stop& stop) {
  require(size == 3 || size == 5, "size", "3 or 5", size);
  filter(grid, size / 2, 1, 0, false, out, threads, stop);
}

Grid<float> median(const Grid<float>& grid, int size, int threads) {
  Grid<float> out;
  median(grid, size, out, threads);
  return out;
}

void without_spikes(const Grid<float>& grid, double tolerance, Grid<float>& out, int threads, const Stop& stop) {
  require(std::isfinite(tolerance) && tolerance > 0, "tolerance_mm", "a positive height in mm", tolerance);
  filter(grid, 1, 2, static_cast<float>(tolerance), true, out, threads, stop);
}

}  // namespace debulk
