#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/row_runs.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/hole_patch.hpp"

namespace debulk {

struct FillOptions {
  double diameter = 20.0;  // mm; a hole wider than this along x or y stays open; 0: fill nothing

  void check() const;
};

// Fills holes. A hole is a missing region (connected over edges or corners) that does not touch the grid's border and
// is not wider than the limit. Other regions stay NaN. Returns what was measured: 1 for values that were there before.
//
// A hole is filled with the sum of two parts. The first is a polynomial through the ring of measured values round it
// (RingFit: of degree 4 where that amplifies no noise, so that the crown of a bell is restored). The second is the
// harmonic surface through the polynomial's residuals at the rim, which is continuous there and never higher or lower
// than at the rim. The ring is three quarters as wide as the hole is deep, and at least three cells wide.
Grid<std::uint8_t> fill_holes(Grid<float>& heights, const FillOptions& options = {}, int threads = 0);
// The same; `measured` is overwritten, and its memory reused.
void fill_holes(Grid<float>& heights, const FillOptions& options, Grid<std::uint8_t>& measured, int threads);

// The same for one grid after another, in memory that is reused. Throws Stopped.
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
