#include "debulk/surface/median.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

#define DEBULK_KERNEL "debulk/surface/median_kernel.inl"
#include "debulk/core/each_isa.inl"

int whole_windows(const float* above, const float* row, const float* below, int nx, float* out, int* incomplete, int& count) {
  return DEBULK_ON(best_isa(), run(above, row, below, nx, out, incomplete, count));
}

// Of the values that are there.
float window_median(const Grid<float>& grid, int i, int j, int reach) {
  if (std::isnan(grid.at(i, j))) return std::numeric_limits<float>::quiet_NaN();
  std::array<float, 25> window{};
  auto last = window.begin();
  for (int y = std::max(0, j - reach); y <= std::min(grid.ny - 1, j + reach); ++y)
    for (int x = std::max(0, i - reach); x <= std::min(grid.nx - 1, i + reach); ++x)
      if (!std::isnan(grid.at(x, y))) *last++ = grid.at(x, y);
  const auto middle = window.begin() + (last - window.begin()) / 2;
  std::nth_element(window.begin(), middle, last);
  return (last - window.begin()) % 2 == 0 ? (*middle + *std::max_element(window.begin(), middle)) / 2 : *middle;
}

}  // namespace

void median(const Grid<float>& grid, int size, Grid<float>& out, int threads) {
  require(size == 3 || size == 5, "size", "3 or 5", size);
  out.nx = grid.nx, out.ny = grid.ny, out.origin = grid.origin, out.spacing = grid.spacing;
  out.values.resize(grid.size());
  const int reach = size / 2;
  parallel_for(grid.ny, 32, threads, [&](long begin, long end) {
    std::vector<int> incomplete(static_cast<std::size_t>(grid.nx));
    for (int j = static_cast<int>(begin); j < end; ++j) {
      int done = 1, count = 0;
      if (size == 3 && j > 0 && j + 1 < grid.ny)
        done = whole_windows(&grid.at(0, j - 1), &grid.at(0, j), &grid.at(0, j + 1), grid.nx, &out.at(0, j), incomplete.data(), count);
      for (int k = 0; k < count; ++k) {
        const int i = incomplete[static_cast<std::size_t>(k)];
        out.at(i, j) = window_median(grid, i, j, reach);
      }
      if (grid.nx > 0) out.at(0, j) = window_median(grid, 0, j, reach);
      for (int i = done; i < grid.nx; ++i) out.at(i, j) = window_median(grid, i, j, reach);
    }
  });
}

Grid<float> median(const Grid<float>& grid, int size, int threads) {
  Grid<float> out;
  median(grid, size, out, threads);
  return out;
}

}  // namespace debulk
