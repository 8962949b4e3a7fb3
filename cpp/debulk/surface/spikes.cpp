#include "debulk/surface/spikes.hpp"

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

#define DEBULK_KERNEL "debulk/surface/spikes_kernel.inl"
#include "debulk/core/each_isa.inl"

int whole_windows(const float* above, const float* row, const float* below, int nx, float tolerance, float* out, int* incomplete, int& count) {
  return DEBULK_ON(best_isa(), run(above, row, below, nx, tolerance, out, incomplete, count));
}

float tamed(const Grid<float>& grid, int i, int j, float tolerance) {
  const float centre = grid.at(i, j);
  if (std::isnan(centre)) return centre;
  std::array<float, 9> window{};
  auto last = window.begin();
  for (int y = j - 2; y <= j + 2; y += 2)
    for (int x = i - 2; x <= i + 2; x += 2)
      if (grid.contains(x, y) && !std::isnan(grid.at(x, y))) *last++ = grid.at(x, y);
  const auto half = window.begin() + (last - window.begin()) / 2;
  std::nth_element(window.begin(), half, last);
  const float found = (last - window.begin()) % 2 == 0 ? (*half + *std::max_element(window.begin(), half)) / 2 : *half;
  return std::abs(centre - found) > tolerance ? found : centre;
}

}  // namespace

void without_spikes(const Grid<float>& grid, double tolerance, Grid<float>& out, int threads) {
  require(std::isfinite(tolerance) && tolerance > 0, "tolerance_mm", "a positive height in mm", tolerance);
  out.nx = grid.nx, out.ny = grid.ny, out.origin = grid.origin, out.spacing = grid.spacing;
  out.values.resize(grid.size());
  const float limit = static_cast<float>(tolerance);
  parallel_for(grid.ny, 32, threads, [&](long begin, long end) {
    std::vector<int> incomplete(static_cast<std::size_t>(grid.nx));
    for (int j = static_cast<int>(begin); j < end; ++j) {
      int done = 2, count = 0;
      if (j > 1 && j + 2 < grid.ny)
        done = whole_windows(&grid.at(0, j - 2), &grid.at(0, j), &grid.at(0, j + 2), grid.nx, limit, &out.at(0, j), incomplete.data(), count);
      for (int k = 0; k < count; ++k) {
        const int i = incomplete[static_cast<std::size_t>(k)];
        out.at(i, j) = tamed(grid, i, j, limit);
      }
      for (int i = 0; i < std::min(2, grid.nx); ++i) out.at(i, j) = tamed(grid, i, j, limit);
      for (int i = done; i < grid.nx; ++i) out.at(i, j) = tamed(grid, i, j, limit);
    }
  });
}

}  // namespace debulk
