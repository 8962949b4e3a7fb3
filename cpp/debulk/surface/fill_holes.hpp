#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/row_runs.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/hole_patch.hpp"

namespace debulk {

struct FillOptions {
  double diameter = 20.0;  // mm; a hole wider than this along x or y stays open. 0: fill nothing

  void check() const;
};

// Fills holes: missing regions (connected over edges or corners) that do not touch the grid's border and are not wider
// than the limit. Others stay NaN. Returns what was measured: 1 for values that were there before.
//
// A hole gets the sum of a polynomial through the ring of measured values round it (RingFit: of degree 4 where that
// amplifies no noise, so that the crown of a bell comes back) and the harmonic surface through what the polynomial
// leaves at the rim, which is continuous there and never higher or lower than at the rim. The ring is three
// quarters as wide as the hole is deep, at least three cells.
Grid<std::uint8_t> fill_holes(Grid<float>& heights, const FillOptions& options = {}, int threads = 0);
// The same; `measured` is overwritten, its memory kept.
void fill_holes(Grid<float>& heights, const FillOptions& options, Grid<std::uint8_t>& measured, int threads);

// The same for one grid after the other, in memory that is reused.
class HoleFilling {
 public:
  void run(Grid<float>& heights, const FillOptions& options, Grid<std::uint8_t>& measured, int threads, const Stop& stop = Stop());

 private:
  void find(const Grid<float>& heights, double diameter, Grid<std::uint8_t>& measured, int threads, const Stop& stop);

  StripRuns missing_;
  std::vector<int> first_, region_;
  std::vector<Hole> regions_, holes_;
  std::vector<Cell> cells_;      // hole by hole
  std::vector<float> fillings_;  // one per cell
  std::vector<HolePatch> patches_;
};

}  // namespace debulk
