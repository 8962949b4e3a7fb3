#pragma once

#include "debulk/core/grid.hpp"

namespace debulk {

// Standard deviation of the noise of heights on a grid, from the median size of the mixed second differences
// [1 -2 1; -2 4 -2; 1 -2 1]. These are 0 on every quadratic surface, and few pockets' rims can shift their median.
// Noise that is correlated over neighbours (after a median filter, say) is underestimated. NaN where no 3 by 3 points
// are known.
double height_noise(const Grid<float>& heights);

}  // namespace debulk
