#include "debulk/surface/row_medians.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/surface/median.hpp"
#include "scene.hpp"

namespace debulk {
namespace {

using namespace testing;

constexpr double pi = 3.14159265358979;

// A ridge 6 mm wide and 1 mm high, (1 + cos) / 2 across, so long, through the middle of a map of 61 by 61 mm; turned and moved.
Grid<float> ridge(double cell, double turn, double off, double length = 1e9) {
  const int n = static_cast<int>(60 / cell) + 1;
  Grid<float> out(n, n, {-30, -30}, cell);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d at = out.position(i, j);
      const double along = at.x() * std::cos(turn) + at.y() * std::sin(turn);
      const double across = at.y() * std::cos(turn) - at.x() * std::sin(turn) - off;
      out.at(i, j) = std::abs(across) < 3 && std::abs(along) < length / 2 ? static_cast<float>((1 + std::cos(pi * across / 3)) / 2) : 0;
    }
  return out;
}

float highest(const Grid<float>& grid) {
  float out = -1;
  for (const float v : grid.values) out = std::fmax(out, v);
  return out;
}

TEST(RowMedians, AStraightRidgeIsReadWithinHalfACellOfItsCrest) {
  for (const double cell : {1.0, 2.0, 3.0}) {
    const double least = (1 + std::cos(pi * cell / 2 / 3)) / 2;
    float worst = 1, by_window = 1;
    for (int k = 0; k < 24; ++k)
      for (int m = 0; m < 5; ++m) {
        const Grid<float> map = ridge(cell, k * pi / 24, m * cell / 4);
        for (const int cells : {5, 13}) worst = std::min(worst, highest(row_medians(map, cells)));
        by_window = std::min(by_window, highest(median(map, 5)));
      }
    EXPECT_GE(worst, least - 1e-6);
    EXPECT_LT(worst, least + 0.05);
    EXPECT_LT(by_window, least - 0.2 * least);
  }
}

TEST(RowMedians, ARidgeIsReadIfMostOfARowLiesOnItAndSeenCellsDecideWhereOthersAreMissing) {
  for (const int cells : {5, 13}) {
    Grid<float> map(41, 41, {0, 0}, 1.0);
    for (int i = 0; i < cells / 2; ++i) map.at(14 + i, 20) = 1;
    EXPECT_EQ(highest(row_medians(map, cells)), 0);
    map.at(14 + cells / 2, 20) = 1;
    EXPECT_EQ(highest(row_medians(map, cells)), 1);
    map.at(15, 20) = nanf;  // as many stand as do not: the higher middle one
    EXPECT_EQ(highest(row_medians(map, cells)), 1);
    for (float& v : map.values) v = nanf;
    for (int i = 0; i <= cells / 2; ++i) map.at(14 + i, 20) = 1;
    EXPECT_EQ(row_medians(map, cells).at(14 + cells / 4, 20), 1);
    map.at(14, 20) = nanf;
    EXPECT_TRUE(std::isnan(row_medians(map, cells).at(14 + cells / 4, 20)));
  }
}

TEST(RowMedians, AgreesWithSortingEachRow) {
  Noise noise(3);
  for (const int nx : {5, 37, 131}) {
    Grid<float> grid(nx, 19, {0, 0}, 1.0);
    for (float& v : grid.values) v = noise.uniform() < 0.4 ? nanf : static_cast<float>(noise.normal());
    for (const int cells : {5, 13}) {
      const Grid<float> out = row_medians(grid, cells, 2);
      for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < nx; ++i) {
          float best = nanf;
          for (int turn = 0; turn < 12; ++turn) {
            const double x = std::cos(turn * pi / 12), y = std::sin(turn * pi / 12), longest = std::max(std::abs(x), std::abs(y));
            std::vector<float> row;
            for (int k = -cells / 2; k <= cells / 2; ++k) {
              const int column = i + static_cast<int>(std::lround(k * x / longest)),
                        line = j + static_cast<int>(std::lround(k * y / longest));
              if (grid.contains(column, line) && !std::isnan(grid.at(column, line))) row.push_back(grid.at(column, line));
            }
            std::sort(row.begin(), row.end());
            if (2 * row.size() > std::size_t(cells)) best = std::fmax(best, row[row.size() / 2]);
          }
          ASSERT_TRUE(out.at(i, j) == best || (std::isnan(best) && std::isnan(out.at(i, j)))) << i << ' ' << j;
        }
    }
  }
  EXPECT_THROW(row_medians(Grid<float>(5, 5, {0, 0}, 1.0), 7), InputError);
}

TEST(RowMedians, LongRowsReadLessNoise) {
  Noise noise(4);
  Grid<float> grid(200, 200, {0, 0}, 1.0);
  for (float& v : grid.values) v = static_cast<float>(0.03 * noise.normal());
  const float by_short = highest(row_medians(grid, 5)), by_long = highest(row_medians(grid, 13));
  EXPECT_LT(by_short, 0.03 * 3.5);  // a median of five scatters by 0.54 of a value; the highest of so many lies 6 of that up
  EXPECT_LT(by_long, 0.75 * by_short);
  const Grid<float> again = row_medians(grid, 5, 3);
  EXPECT_EQ(again.values, row_medians(grid, 5, 1).values);
}

}  // namespace
}  // namespace debulk
