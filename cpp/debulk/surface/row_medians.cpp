#include "debulk/surface/row_medians.hpp"

#include <algorithm>
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
constexpr int kTurns = 12;

#define DEBULK_KERNEL "debulk/surface/row_medians_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

// Where the cells of each direction's row lie, from its middle, in a grid so wide.
std::vector<std::ptrdiff_t> places(int cells, std::ptrdiff_t width) {
  std::vector<std::ptrdiff_t> out;
  for (int turn = 0; turn < kTurns; ++turn) {
    const double angle = turn * std::acos(-1.0) / kTurns, x = std::cos(angle), y = std::sin(angle),
                 longest = std::max(std::abs(x), std::abs(y));
    for (int k = -(cells / 2); k <= cells / 2; ++k) out.push_back(std::lround(k * y / longest) * width + std::lround(k * x / longest));
  }
  return out;
}

}  // namespace

Grid<float> row_medians(const Grid<float>& grid, int cells, int threads, const Stop& stop) {
  require(cells == 5 || cells == 13, "cells", "5 or 13", cells);
  constexpr int kLanes = base::lanes;
  const int reach = cells / 2, whole = (grid.nx + kLanes - 1) / kLanes * kLanes;
  const float missing = std::numeric_limits<float>::quiet_NaN();
  Grid<float> padded(whole + 2 * reach, grid.ny + 2 * reach, grid.origin, grid.spacing, missing), out = grid.like(missing);
  for (int j = 0; j < grid.ny; ++j) std::copy_n(&grid.values[std::size_t(j) * grid.nx], grid.nx, &padded.at(reach, j + reach));
  const std::vector<std::ptrdiff_t> at = places(cells, padded.nx);
  const Isa isa = best_isa();
  parallel_for(grid.ny, 16, threads, stop, [&](long begin, long end) {
    std::vector<float> row(static_cast<std::size_t>(whole));
    for (int j = static_cast<int>(begin); j < end; ++j) {
      DEBULK_ON(isa, run(cells, &padded.at(reach, j + reach), at.data(), grid.nx, row.data()));
      std::copy_n(row.begin(), grid.nx, &out.values[std::size_t(j) * grid.nx]);
    }
  });
  return out;
}

}  // namespace debulk
