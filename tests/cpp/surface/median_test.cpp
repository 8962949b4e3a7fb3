#include "debulk/surface/median.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "debulk/core/error.hpp"
#include "scene.hpp"

namespace debulk {
namespace {

using namespace testing;

TEST(Median, AgreesWithSortingTheWindow) {
  Noise noise(1);
  for (const auto& [nx, size, missing] :
       {std::tuple{17, 3, 0.3}, std::tuple{17, 5, 0.3}, std::tuple{131, 3, 0.01}, std::tuple{2, 3, 0.1}}) {
    Grid<float> grid(nx, 13, {0, 0}, 1.0);
    for (float& v : grid.values) v = noise.uniform() < missing ? nanf : static_cast<float>(noise.normal());
    const Grid<float> out = median(grid, size, 2);
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        if (std::isnan(grid.at(i, j))) {
          EXPECT_TRUE(std::isnan(out.at(i, j)));
          continue;
        }
        std::vector<float> window;
        for (int y = j - size / 2; y <= j + size / 2; ++y)
          for (int x = i - size / 2; x <= i + size / 2; ++x)
            if (grid.contains(x, y) && !std::isnan(grid.at(x, y))) window.push_back(grid.at(x, y));
        std::sort(window.begin(), window.end());
        EXPECT_EQ(out.at(i, j), (window[(window.size() - 1) / 2] + window[window.size() / 2]) / 2);
      }
  }
  EXPECT_THROW(median(Grid<float>(5, 5, {0, 0}, 1.0), 4), InputError);
}

}  // namespace
}  // namespace debulk
