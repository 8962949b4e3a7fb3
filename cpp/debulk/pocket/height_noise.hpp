#pragma once

#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// Standard deviation of the noise of heights on a grid, from the median size of the mixed second differences
// [1 -2 1; -2 4 -2; 1 -2 1], which no quadratic surface feels and few pockets' rims can shift. Noise that is correlated
// over neighbours (after a median filter, say) is estimated too low. NaN where no 3 by 3 points are known.
double height_noise(const Grid<float>& heights);
// Over rectangles of grids, [i0, i1) by [j0, j1), as over one grid.
struct GridPart {
  const Grid<float>* grid;
  int i0, j0, i1, j1;
};
double height_noise(const std::vector<GridPart>& parts);

}  // namespace debulk
