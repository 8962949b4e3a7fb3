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

TEST(WithoutSpikes, ComparesEachValueWithTheNineTwoApart) {
  Noise noise(2);
  for (const auto& [nx, ny, missing] : {std::tuple{131, 17, 0.01}, std::tuple{40, 9, 0.3}, std::tuple{3, 2, 0.1}}) {
    Grid<float> grid(nx, ny, {0, 0}, 1.0), out;
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {  // no two spikes are among the nine of any value
        const double spike = i % 7 == 1 && j % 5 == 1 ? 3 : 0;
        grid.at(i, j) = noise.uniform() < missing ? nanf : static_cast<float>(spike + 0.1 * noise.normal());
      }
    without_spikes(grid, 0.5, out, 2);
    long spikes = 0;
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        if (std::isnan(grid.at(i, j))) {
          EXPECT_TRUE(std::isnan(out.at(i, j)));
          continue;
        }
        std::vector<float> window;
        for (int y = j - 2; y <= j + 2; y += 2)
          for (int x = i - 2; x <= i + 2; x += 2)
            if (grid.contains(x, y) && !std::isnan(grid.at(x, y))) window.push_back(grid.at(x, y));
        std::sort(window.begin(), window.end());
        const float middle = (window[(window.size() - 1) / 2] + window[window.size() / 2]) / 2;
        const bool spike = std::abs(grid.at(i, j) - middle) > 0.5f;
        EXPECT_EQ(out.at(i, j), spike ? middle : grid.at(i, j));
        spikes += spike;
      }
    EXPECT_GE(spikes, nx > 5 ? 8 : 0);
  }
  Grid<float> out;
  EXPECT_THROW(without_spikes(Grid<float>(5, 5, {0, 0}, 1.0), 0, out, 1), InputError);
}

TEST(WithoutSpikes, KeepsNarrowBumpsOfWideCellsAndTakesFlyingPixels) {
  const double high = 3.6, radius = 9;
  Grid<float> grid(61, 31, {0, 0}, 2.0, 0.0f), out;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const double u = std::min(1.0, std::hypot(2.0 * (i - 15), 2.0 * (j - 15)) / radius);
      grid.at(i, j) = static_cast<float>(high * (1 - u * u) * (1 - u * u));
    }
  const Grid<float> bump = grid;
  grid.at(45, 15) = grid.at(46, 15) = 1.9f;
  for (int i = 40; i < 46; ++i) grid.at(i, 22) = 1.9f, grid.at(i, 23) = 1.6f;  // a row of pixels
  without_spikes(grid, 1.0, out, 2);
  EXPECT_EQ(out.values, bump.values);
}

TEST(WithoutSpikes, KeepsTheTopOfANarrowBumpOfFineCells) {
  Grid<float> grid(61, 61, {0, 0}, 0.75), out;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i)
      grid.at(i, j) = static_cast<float>(3.8 * std::exp(-0.5 * std::pow(0.75 * std::hypot(i - 30, j - 30) / 2.3, 2)));
  const Grid<float> bump = grid;
  grid.at(50, 10) = 1.9f;  // flies over the flat ply
  without_spikes(grid, 0.5, out, 2);
  for (std::size_t k = 0; k < grid.size(); ++k) EXPECT_NEAR(out.values[k], bump.values[k], 1e-6);
}

}  // namespace
}  // namespace debulk
