#pragma once

#include <array>
#include <vector>

#include "debulk/surface/hole_patch.hpp"

namespace debulk {

// Fills small holes: nearly all holes have one to three cells. What HolePatch fills into such a hole is linear in the
// heights round it, with factors that depend only on its shape. They are computed once.
class SmallHoles {
 public:
  static const SmallHoles& table();

  // Returns false if the hole is too large, or if a height round it is missing or beyond the grid. HolePatch is to
  // fill it then.
  bool fill(const Grid<float>& heights, const Hole& hole, float* out) const;

 private:
  static constexpr int most = 3;               // cells
  static constexpr int reach = 3, side = 16;   // cells: of the ring; of the square in which a shape is studied
  static constexpr int wide = 5, places = 15;  // where a further cell can lie: -2 .. 2 columns, 0 .. 2 rows off the first
  struct Shape {
    std::vector<Cell> ring;       // relative to the first cell
    std::vector<double> factors;  // for each cell of the hole, one per cell of the ring
  };
  SmallHoles();
  static int number(const Hole& hole);  // of the shape; -1: none

  std::array<Shape, places * places> shapes_;
};

}  // namespace debulk
