#pragma once

#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// Standard deviation of the noise of heights on a grid, from the median size of the mixed second differences
// [1 -2 1; -2 4 -2; 1 -2 1]. These are 0 on every quadratic surface, and few pockets' rims can shift their median.
// Noise that is correlated over neighbours (after a median filter, say) is underestimated. NaN where no 3 by 3 points
// are known.
double height_noise(const Grid<float>& heights);
// The same over several rectangles of grids, [i0, i1) by [j0, j1), taken together.
struct GridPart {
  const Grid<float>* grid;
  int i0, j0, i1, j1;
};
double height_noise(const std::vector<GridPart>& parts);

}  // namespace debulk
