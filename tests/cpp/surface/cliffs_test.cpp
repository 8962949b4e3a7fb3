#include "debulk/surface/cliffs.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "debulk/core/error.hpp"
#include "debulk/surface/fit_reference.hpp"
#include "debulk/surface/misfit.hpp"
#include "scene.hpp"

namespace debulk {
namespace {

using namespace testing;

double sphere_height(double x, double y) {
  return std::sqrt(1500.0 * 1500.0 - x * x - y * y) - 1500;
}
double plate(double x, double y) {
  return 0.0006 * x * x - 0.0004 * y * y + 0.05 * x;
}
// Distance from the edge of the plate, which crosses the grid aslant; negative beside it.
double inward(double x, double y) {
  return (60 - x - 0.3 * y) / std::hypot(1.0, 0.3);
}

// A noisy plate that ends at a cliff above a table; between them a gap, as a camera that looks aslant leaves it.
Grid<float> plate_on_table(double drop, double gap, double sigma, double spacing = 0.5) {
  Noise noise(5);
  Grid<float> grid(static_cast<int>(240 / spacing), static_cast<int>(160 / spacing), {-130, -80}, spacing);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      const double in = inward(p.x(), p.y()), error = sigma * noise.normal();
      grid.at(i, j) = in > 0 ? static_cast<float>(plate(p.x(), p.y()) + error) : in > -gap ? nanf : static_cast<float>(error - drop);
    }
  return grid;
}

// The largest error of a fit on the plate, up to its last point.
double worst_on_plate(const Reference& fit, const Grid<float>& grid) {
  double most = 0;
  for (int j = 0; j < grid.ny; j += 3)
    for (int i = 0; i < grid.nx; i += 3) {
      const Eigen::Vector2d p = grid.position(i, j);
      if (inward(p.x(), p.y()) > 0) most = std::max(most, std::abs(fit.height(p) - plate(p.x(), p.y())));
    }
  return most;
}

TEST(Cliffs, TheUpperSideIsFittedUpToItsLastPoint) {
  for (const double drop : {15.0, 60.0, 110.0})
    for (const double gap : {0.0, 3.0, 0.3 * drop}) {
      const Grid<float> grid = plate_on_table(drop, gap, 0.05);
      EXPECT_LT(worst_on_plate(fit_reference(grid), grid), 0.08) << drop << " mm, gap " << gap;
    }
  const Grid<float> coarse = plate_on_table(60, 0, 0.05, 1.0);
  EXPECT_LT(worst_on_plate(fit_reference(coarse), coarse), 0.15);
}

TEST(Cliffs, WhatIsHiddenIsOfTheLowerSideAndNear) {
  const Grid<float> grid = plate_on_table(60, 0, 0.05);
  Grid<float> kept = grid;
  EXPECT_NE(hide_beside_cliffs(kept).size(), 0u);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      const double in = inward(p.x(), p.y());
      if (in > 0 || in < -60) {  // a square of 80 mm, aslant
        EXPECT_FALSE(std::isnan(kept.at(i, j))) << p.transpose();
      }
      if (in <= 0 && in > -35) {
        EXPECT_TRUE(std::isnan(kept.at(i, j))) << p.transpose();
      }
    }
}

TEST(Cliffs, TheSideThatThePlyLiesOnStaysBelowAHigherFrame) {
  Grid<float> grid = plate_on_table(-25, 0, 0.05);  // "table": a frame that stands above the plate
  auto on_plate = grid.like<std::uint8_t>();
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) on_plate.at(i, j) = inward(grid.position(i, j).x(), grid.position(i, j).y()) > 10;
  EXPECT_LT(worst_on_plate(fit_reference(grid, {}, 0, Stop(), on_plate), grid), 0.08);
  EXPECT_GT(worst_on_plate(fit_reference(grid), grid), 10);  // without an outline the upper side stays
  EXPECT_THROW(fit_reference(grid, {}, 0, Stop(), Grid<std::uint8_t>(3, 2, {0, 0}, 0.5)), InputError);
}

TEST(Cliffs, ThereIsNoneOnWhatIsOneSurface) {
  Noise noise(2);
  Grid<float> grid(400, 300, {0, 0}, 0.5);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      double z = 12 * std::tanh((p.x() - 100) / 7) + 0.1 * noise.normal();       // a flank of 60 degrees
      if (noise.uniform() < 0.005) z += 30;                                      // flying points
      grid.at(i, j) = p.y() > 70 && p.y() < 100 ? nanf : static_cast<float>(z);  // a drop-out from side to side
    }
  Grid<float> kept = grid;
  EXPECT_EQ(hide_beside_cliffs(kept).size(), 0u);
  for (std::size_t k = 0; k < grid.size(); ++k) EXPECT_EQ(std::isnan(kept.values[k]), std::isnan(grid.values[k]));
}

TEST(Cliffs, AClampTakesNothingOfTheMold) {
  Grid<float> grid(480, 320, {0, 0}, 0.5, 0.0f);
  for (int j = 100; j < 180; ++j)
    for (int i = 100; i < 180; ++i) grid.at(i, j) = 25;  // 40 by 40 mm
  Grid<float> kept = grid;
  hide_beside_cliffs(kept);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i)
      if (grid.at(i, j) == 0) {
        EXPECT_FALSE(std::isnan(kept.at(i, j)));
      }
}

TEST(Cliffs, TheFitHasTheSameBitsOnAnyNumberOfThreads) {
  const Grid<float> grid = plate_on_table(60, 3, 0.05);
  const Reference one = fit_reference(grid, {}, 1);
  const Grid<std::uint8_t> off = misfits(grid, one, 1);
  for (const int threads : {2, 5}) {
    EXPECT_EQ(one.heights().values, fit_reference(grid, {}, threads).heights().values);
    EXPECT_EQ(off.values, misfits(grid, one, threads).values);
  }
}

// A groove through the middle, along y.
Grid<float> grooved(double width, double depth, double sigma) {
  Noise noise(9);
  Grid<float> grid(400, 300, {-100, -75}, 0.5);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      const double at = std::abs(p.x()) < width / 2 ? std::pow(std::cos(M_PI * p.x() / width), 2) : 0;
      grid.at(i, j) = static_cast<float>(sphere_height(p.x(), p.y()) - depth * at + sigma * noise.normal());
    }
  return grid;
}

TEST(Misfit, NarrowGroovesAreFollowedOrMarked) {
  for (const auto& [width, depth] : {std::pair{30.0, 6.0}, std::pair{16.0, 6.0}, std::pair{10.0, 4.0}, std::pair{6.0, 3.0}}) {
    const Grid<float> grid = grooved(width, depth, 0.05);
    const Reference fit = fit_reference(grid);
    const Grid<std::uint8_t> off = misfits(grid, fit);
    for (int j = 20; j < grid.ny - 20; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const Eigen::Vector2d p = grid.position(i, j);
        const double at = std::abs(p.x()) < width / 2 ? std::pow(std::cos(M_PI * p.x() / width), 2) : 0;
        const double error = std::abs(fit.height(p) - sphere_height(p.x(), p.y()) + depth * at);
        if (error > 0.7) {
          EXPECT_EQ(off.at(i, j), 1) << width << " mm, " << p.transpose() << ": " << error;
        }
        if (std::abs(p.x()) > width / 2 + 20) {
          EXPECT_EQ(off.at(i, j), 0) << p.transpose();
        }
      }
  }
  EXPECT_NEAR(fit_reference(grooved(16, 6, 0.05)).height({0, 0}), -6, 0.3);  // 3.8 mm deep with the window of smooth molds
}

TEST(Misfit, NoiseIsNone) {
  for (const double sigma : {0.0, 0.05, 0.3}) {
    const Grid<float> grid = grooved(40, 0, sigma);
    const Grid<std::uint8_t> off = misfits(grid, fit_reference(grid));
    EXPECT_EQ(std::count(off.values.begin(), off.values.end(), 1), 0) << sigma;
  }
}

}  // namespace
}  // namespace debulk
