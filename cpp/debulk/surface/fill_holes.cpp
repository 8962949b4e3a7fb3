#include "debulk/surface/fill_holes.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"
#include "debulk/surface/small_holes.hpp"

namespace debulk {
namespace {

#define DEBULK_KERNEL "debulk/surface/missing_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

constexpr long share = 64;  // number of holes that one thread fills before it asks for more

}  // namespace

// Finds what was measured, and the missing regions that are to be filled, in the order of their first cells.
void HoleFilling::find(const Grid<float>& heights, double diameter, Grid<std::uint8_t>& measured, int threads, const Stop& stop) {
  missing_.clear(heights.ny);
  const Isa isa = best_isa();
  parallel_for(heights.ny, StripRuns::rows, threads, stop, [&](long first, long last) {
    for (int j = static_cast<int>(first); j < last; ++j) {
      RunWriter runs(missing_.strip(first), j);
      DEBULK_ON(isa, run(&heights.at(0, j), heights.nx, &measured.at(0, j), runs));
    }
  });
  const std::vector<Run>& runs = missing_.join();
  join_runs(runs, 1, first_);
  regions_.resize(runs.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const Run& run = runs[k];
    Hole& region = regions_[static_cast<std::size_t>(first_[k])];
    if (static_cast<std::size_t>(first_[k]) == k) region = {nullptr, 0, run.begin, run.end - 1, run.row, run.row};
    region.count += run.end - run.begin;
    region.left = std::min(region.left, run.begin), region.right = std::max(region.right, run.end - 1);
    region.high = run.row;
  }
  const auto wanted = [&](const Hole& h) {
    const bool inside = h.left > 0 && h.low > 0 && h.right < heights.nx - 1 && h.high < heights.ny - 1;
    return inside && h.width() * heights.spacing <= diameter;
  };
  // First each region's place among the holes (-1: none), then each hole's cells, behind those of the hole before it.
  holes_.clear();
  region_.assign(runs.size(), -1);
  std::size_t total = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (static_cast<std::size_t>(first_[k]) != k || !wanted(regions_[k])) continue;
    region_[k] = static_cast<int>(holes_.size());
    holes_.push_back(regions_[k]);
    total += static_cast<std::size_t>(regions_[k].count);
  }
  cells_.resize(total), fillings_.resize(total);
  std::size_t next = 0;
  for (Hole& hole : holes_) {
    hole.cells = cells_.data() + next;
    next += static_cast<std::size_t>(hole.count), hole.count = 0;
  }
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const int which = region_[static_cast<std::size_t>(first_[k])];
    if (which < 0) continue;
    Hole& hole = holes_[static_cast<std::size_t>(which)];
    Cell* to = cells_.data() + (hole.cells - cells_.data());
    for (int i = runs[k].begin; i < runs[k].end; ++i) to[hole.count++] = {i, runs[k].row};
  }
}

void HoleFilling::run(Grid<float>& heights, const FillOptions& options, Grid<std::uint8_t>& measured, int threads, const Stop& stop) {
  options.check();
  measured.nx = heights.nx, measured.ny = heights.ny, measured.origin = heights.origin, measured.spacing = heights.spacing;
  measured.values.resize(heights.size());
  if (heights.size() == 0) return;
  find(heights, options.diameter, measured, threads, stop);
  const SmallHoles& small = SmallHoles::table();
  const long count = static_cast<long>(holes_.size());
  patches_.resize(static_cast<std::size_t>((count + share - 1) / share));
  parallel_for(count, share, threads, stop, [&](long begin, long end) {
    HolePatch& patch = patches_[static_cast<std::size_t>(begin / share)];
    for (auto h = static_cast<std::size_t>(begin); h < static_cast<std::size_t>(end); ++h) {
      float* out = fillings_.data() + (holes_[h].cells - cells_.data());
      if (!small.fill(heights, holes_[h], out)) patch.fill(heights, holes_[h], out, stop);
    }
  });
  // Only now, so that all rings hold measured heights.
  for (std::size_t k = 0; k < cells_.size(); ++k) heights.at(cells_[k].i, cells_[k].j) = fillings_[k];
}

void FillOptions::check() const {
  require(std::isfinite(diameter) && diameter >= 0, "hole_diameter_mm", "a length in mm, or 0 to fill nothing", diameter);
}

void fill_holes(Grid<float>& heights, const FillOptions& options, Grid<std::uint8_t>& measured, int threads) {
  HoleFilling().run(heights, options, measured, threads);
}

Grid<std::uint8_t> fill_holes(Grid<float>& heights, const FillOptions& options, int threads) {
  Grid<std::uint8_t> measured;
  fill_holes(heights, options, measured, threads);
  return measured;
}

}  // namespace debulk
