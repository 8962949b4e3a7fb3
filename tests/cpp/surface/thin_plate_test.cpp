#include "debulk/surface/thin_plate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace debulk {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

double bowl(int i, int j) {
  return 3 * std::sin(0.004 * i) * std::cos(0.003 * j) + 0.002 * i;
}

// Bowls with what `unknown` says taken out; what the plate puts there, held against the bowl.
template <class Unknown>
double worst_error(int nx, int ny, const Unknown& unknown, std::size_t& count) {
  Grid<double> heights(nx, ny, {0, 0}, 0.5);
  std::vector<std::size_t> points;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      heights.at(i, j) = unknown(i, j) ? nan : bowl(i, j);
      if (unknown(i, j)) points.push_back(heights.index(i, j));
    }
  count = points.size();
  const std::vector<double> plate = thin_plate(heights, points, 1e-4);
  EXPECT_EQ(plate.size(), points.size());
  double worst = 0;
  for (std::size_t n = 0; n < plate.size(); ++n) {
    const int i = static_cast<int>(points[n]) % nx, j = static_cast<int>(points[n]) / nx;
    const double off = std::abs(plate[n] - bowl(i, j));
    EXPECT_FALSE(std::isnan(off)) << i << " " << j;
    worst = std::max(worst, off);
  }
  return worst;
}

// Too large for one factorisation: as good as the plate itself, whose error grows with the hole.
TEST(ThinPlate, LargeHolesAreFilledOnACoarserGrid) {
  std::size_t count = 0;
  const auto disc = [](double radius) { return [=](int i, int j) { return std::hypot(i - 300, j - 290) < radius; }; };
  EXPECT_LT(worst_error(600, 600, disc(40), count), 0.003);
  EXPECT_LT(count, 6000u);  // in one
  EXPECT_LT(worst_error(600, 600, disc(80), count), 0.03);
  EXPECT_GT(count, 20000u);
  EXPECT_LT(worst_error(600, 600, disc(240), count), 1.0);
  EXPECT_GT(count, 180000u);
}

TEST(ThinPlate, StripsRingsAndMeshesOfManyPointsStayAccurate) {
  std::size_t count = 0;
  const double strip = worst_error(4000, 60, [](int i, int j) { return i > 5 && i < 3990 && j > 17 && j < 42; }, count);
  EXPECT_GT(count, 90000u);
  EXPECT_LT(strip, 0.01);
  const double ring = worst_error(1500, 1500, [](int i, int j) { return std::abs(std::hypot(i - 750.3, j - 749.6) - 700) < 6; }, count);
  EXPECT_GT(count, 40000u);
  EXPECT_LT(ring, 0.01);
  std::mt19937 random(3);
  std::vector<bool> coin(700 * 700);
  for (std::size_t k = 0; k < coin.size(); ++k) coin[k] = random() % 2;
  const double mesh = worst_error(
      700, 700, [&](int i, int j) { return i > 2 && j > 2 && i < 697 && j < 697 && coin[static_cast<std::size_t>(j) * 700 + i]; }, count);
  EXPECT_GT(count, 200000u);
  EXPECT_LT(mesh, 0.1);
}

TEST(ThinPlate, WhatNoHeightHoldsIsNotDetermined) {
  Grid<double> heights(200, 200, {0, 0}, 1.0, nan);
  std::vector<std::size_t> points(heights.size());
  for (std::size_t k = 0; k < points.size(); ++k) points[k] = k;
  EXPECT_TRUE(thin_plate(heights, points).empty());
  points.resize(300);
  EXPECT_TRUE(thin_plate(heights, points).empty());
}

TEST(ThinPlate, HeedsTheStop) {
  Grid<double> heights(300, 300, {0, 0}, 1.0, 1.0);
  std::vector<std::size_t> points;
  for (int j = 100; j < 200; ++j)
    for (int i = 100; i < 200; ++i) heights.at(i, j) = nan, points.push_back(heights.index(i, j));
  Stop stop;
  EXPECT_EQ(thin_plate(heights, points, 0, stop).size(), points.size());
  stop.cancel();
  EXPECT_THROW(thin_plate(heights, points, 0, stop), Stopped);
}

}  // namespace
}  // namespace debulk
