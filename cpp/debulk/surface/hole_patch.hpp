#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/ring_fit.hpp"

namespace debulk {

struct Cell {
  int i, j;
};

// A missing region that is connected over edges or corners: its cells row by row, and its box, which includes both
// ends.
struct Hole {
  const Cell* cells;
  int count;
  int left, right, low, high;
  int width() const { return (right - left > high - low ? right - left : high - low) + 1; }
};

// Fills one hole after another (see fill_holes.hpp), and reuses its memory.
class HolePatch {
 public:
  // Writes one height per cell. The hole must not touch the grid's border. Throws Stopped.
  void fill(const Grid<float>& heights, const Hole& hole, float* out, const Stop& stop = Stop());

 private:
  std::size_t at(const Cell& c) const { return static_cast<std::size_t>(c.j - top_) * nx_ + (c.i - left_); }
  void surround(const Grid<float>& heights, const Hole& hole);
  int depth();
  void harmonic(const Grid<float>& heights, const Hole& hole, const RingFit& trend, const Stop& stop);

  int left_ = 0, top_ = 0, nx_ = 0;                      // position and columns of the hole with its surroundings
  std::vector<int> number_;                              // of the hole's cells, else -1
  std::vector<std::uint8_t> marks_, outside_, scratch_;  // hole and ring; all but the hole, grown inwards
  std::vector<RingPoint> ring_, inside_;
  std::vector<double> band_, rest_;
};

}  // namespace debulk
