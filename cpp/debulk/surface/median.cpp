#include "debulk/surface/median.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {

Grid<float> median(const Grid<float>& grid, int size, int threads) {
  require(size == 3 || size == 5, "size", "3 or 5", size);
  Grid<float> out = grid.like<float>(std::numeric_limits<float>::quiet_NaN());
  const int reach = size / 2;
  parallel_for(grid.ny, 16, threads, [&](long begin, long end) {
    std::array<float, 25> window;
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        if (std::isnan(grid.at(i, j))) continue;
        auto last = window.begin();
        for (int y = std::max(0, j - reach); y <= std::min(grid.ny - 1, j + reach); ++y)
          for (int x = std::max(0, i - reach); x <= std::min(grid.nx - 1, i + reach); ++x)
            if (!std::isnan(grid.at(x, y))) *last++ = grid.at(x, y);
        const auto middle = window.begin() + (last - window.begin()) / 2;
        std::nth_element(window.begin(), middle, last);
        out.at(i, j) = *middle;
        if ((last - window.begin()) % 2 == 0) out.at(i, j) = (*middle + *std::max_element(window.begin(), middle)) / 2;
      }
  });
  return out;
}

}  // namespace debulk
