// Medians of squares, against sorting, with missing values and squares that the border cuts.

#include "debulk/surface/pooled.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace debulk {
namespace {

TEST(PooledMedians, AreThoseOfSortingWhereAQuarterIsKnown) {
  for (const int side : {1, 2, 3, 4}) {
    Grid<float> values(61, 38, {5, -7}, 0.5);
    std::mt19937 random(static_cast<unsigned>(side));
    std::normal_distribution<float> normal(0, 1);
    for (std::size_t k = 0; k < values.size(); ++k)
      values.values[k] = random() % 8 < k * 8 / values.size() ? std::numeric_limits<float>::quiet_NaN() : normal(random);
    const Grid<float> medians = pooled_medians(values, side, 2, Stop());
    int missing = 0;
    for (int j = 0; j < medians.ny; ++j)
      for (int i = 0; i < medians.nx; ++i) {
        std::vector<float> known;
        for (int y = j * side; y < std::min(values.ny, (j + 1) * side); ++y)
          for (int x = i * side; x < std::min(values.nx, (i + 1) * side); ++x)
            if (!std::isnan(values.at(x, y))) known.push_back(values.at(x, y));
        std::sort(known.begin(), known.end());
        if (known.empty() || 4 * static_cast<int>(known.size()) < side * side) {
          EXPECT_TRUE(std::isnan(medians.at(i, j)));
          ++missing;
        } else {
          EXPECT_EQ(medians.at(i, j), known[known.size() / 2]) << side << " " << i << " " << j;
        }
      }
    EXPECT_GT(missing, 0) << side;
  }
}

}  // namespace
}  // namespace debulk
