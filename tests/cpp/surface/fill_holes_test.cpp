#include "debulk/surface/fill_holes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "scene.hpp"

namespace debulk {
namespace {

using namespace testing;

Grid<float> heights(const Height& f, double sigma, double spacing, std::uint64_t seed) {
  Noise noise(seed);
  const int n = static_cast<int>(80 / spacing) + 1;
  Grid<float> grid(n, n, {-40, -40}, spacing);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      grid.at(i, j) = static_cast<float>(f(p.x(), p.y()) + sigma * noise.normal());
    }
  return grid;
}

void drop_disc(Grid<float>& grid, double x, double y, double diameter) {
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i)
      if ((grid.position(i, j) - Eigen::Vector2d(x, y)).norm() < diameter / 2) grid.at(i, j) = nanf;
}

double worst_filled(const Grid<float>& grid, const Grid<std::uint8_t>& measured, const Height& f) {
  double worst = 0;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      if (!measured.at(i, j)) worst = std::max(worst, std::abs(grid.at(i, j) - f(p.x(), p.y())));
    }
  return worst;
}

TEST(FillHoles, ReproducesQuarticsAcrossADisc) {
  const Height f = [](double x, double y) { return 1 + 0.1 * x - 0.02 * x * y + 1e-4 * x * x * y * y - 1e-5 * y * y * y * y; };
  Grid<float> grid = heights(f, 0, 1.0, 1);
  drop_disc(grid, 2, -3, 15);
  const Grid<std::uint8_t> measured = fill_holes(grid);
  EXPECT_EQ(std::count(measured.values.begin(), measured.values.end(), 0), 177);
  EXPECT_LT(worst_filled(grid, measured, f), 1e-4);
}

TEST(FillHoles, BringsBackTheCrownsOfBells) {
  struct Case {
    double peak, wide, disc, allowed;
  };
  for (const auto& [peak, wide, disc, allowed] :
       {Case{10, 60, 19, 0.1}, Case{10, 60, 10, 0.01}, Case{15, 78, 19, 0.1}, Case{4, 30, 8, 0.05}, Case{4, 30, 10, 0.1}})
    for (const double spacing : {0.5, 1.0}) {
      const Height f = [&, p = peak, w = wide](double x, double y) { return bell(x, y, p, w); };
      Grid<float> grid = heights(f, 0, spacing, 1);
      drop_disc(grid, 0.3, -0.2, disc);
      const Grid<std::uint8_t> measured = fill_holes(grid);
      EXPECT_LT(worst_filled(grid, measured, f), allowed) << peak << " high, " << wide << " wide, disc " << disc << ", grid " << spacing;
    }
}

TEST(FillHoles, DoesNotAmplifyTheRingsNoise) {
  const double sigma = 0.15;
  for (const double disc : {1.2, 3.0, 8.0, 19.0})
    for (const double spacing : {0.5, 1.0}) {
      double squares = 0, worst = 0;
      int count = 0;
      for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Grid<float> grid = heights([](double, double) { return 0.0; }, sigma, spacing, seed);
        drop_disc(grid, 0.3, -0.2, disc);
        const Grid<std::uint8_t> measured = fill_holes(grid);
        for (std::size_t k = 0; k < grid.size(); ++k)
          if (!measured.values[k])
            squares += grid.values[k] * grid.values[k], worst = std::max(worst, std::abs(1.0 * grid.values[k])), ++count;
      }
      EXPECT_LT(std::sqrt(squares / count), sigma) << disc << " at " << spacing;
      EXPECT_LT(worst, 3.5 * sigma) << disc << " at " << spacing;
    }
}

TEST(FillHoles, LeavesWideHolesAndThoseAtTheBorderOpen) {
  const Height f = [](double x, double) { return x; };
  Grid<float> grid = heights(f, 0, 0.5, 1);
  drop_disc(grid, 0, 0, 21);
  drop_disc(grid, 40, 10, 6);
  drop_disc(grid, -25, -25, 5);
  for (int i = 20; i < 30; ++i) grid.at(i, i + 60) = nanf;  // connected over corners
  const Grid<float> before = grid;
  const Grid<std::uint8_t> measured = fill_holes(grid);
  EXPECT_TRUE(std::isnan(grid.at(80, 80)));
  EXPECT_TRUE(std::isnan(grid.at(160, 100)));
  EXPECT_NEAR(grid.at(30, 30), -25, 1e-4);
  EXPECT_NEAR(grid.at(25, 85), -27.5, 1e-4);
  for (std::size_t k = 0; k < grid.size(); ++k) {
    EXPECT_EQ(measured.values[k], !std::isnan(before.values[k]));
    if (measured.values[k]) {
      EXPECT_EQ(grid.values[k], before.values[k]);
    }
  }
}

TEST(FillHoles, CopesWithHolesWithinHolesAndThinRings) {
  Grid<float> grid(30, 30, {0, 0}, 1.0, nanf);
  for (int k = 5; k < 25; ++k) grid.at(k, 5) = grid.at(k, 24) = grid.at(5, k) = grid.at(24, k) = 7.0f;  // one cell wide
  grid.at(14, 14) = 7.0f;
  const Grid<std::uint8_t> measured = fill_holes(grid);
  EXPECT_NEAR(grid.at(10, 17), 7, 1e-3);
  EXPECT_TRUE(std::isnan(grid.at(2, 2)));
  EXPECT_EQ(measured.at(14, 14), 1);
  Grid<float> empty(4, 4, {0, 0}, 1.0, nanf);
  fill_holes(empty);
  for (const float z : empty.values) EXPECT_TRUE(std::isnan(z));
  EXPECT_THROW(fill_holes(grid, {-1.0}), InputError);
}

// One large hole is a system of many thousand unknowns: a second's work.
TEST(FillHoles, HeedsAStopWithinOneHole) {
  constexpr int side = 160;
  Grid<float> grid(side + 8, side + 8, {0, 0}, 1.0, 1.0f);
  std::vector<Cell> cells;
  for (int j = 4; j < side + 4; ++j)
    for (int i = 4; i < side + 4; ++i) grid.at(i, j) = nanf, cells.push_back({i, j});
  const Hole hole{cells.data(), static_cast<int>(cells.size()), 4, side + 3, 4, side + 3};
  std::vector<float> out(cells.size());
  HolePatch patch;
  patch.fill(grid, hole, out.data());
  EXPECT_NEAR(out[out.size() / 2], 1, 1e-4);
  const Stop stop;
  stop.cancel();
  EXPECT_THROW(patch.fill(grid, hole, out.data(), stop), Stopped);
}

}  // namespace
}  // namespace debulk
