#include "debulk/surface/fit_reference.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "debulk/core/error.hpp"
#include "debulk/surface/misfit.hpp"
#include "scene.hpp"

namespace debulk {
namespace {

using namespace testing;

Grid<float> heights(const Height& f, int nx, int ny, double spacing, double sigma) {
  Noise noise(7);
  Grid<float> grid(nx, ny, {-100, -80}, spacing);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      grid.at(i, j) = static_cast<float>(f(p.x(), p.y()) + sigma * noise.normal());
    }
  return grid;
}

double sphere(double x, double y) {
  return std::sqrt(1000.0 * 1000.0 - x * x - y * y) - 1000;
}
double waves(double x, double y) {
  return 3 * std::sin(2 * M_PI * x / 350) + 2 * std::cos(2 * M_PI * (x + y) / 400);
}

double worst(const Reference& fit, const Grid<float>& grid, const Height& f, double margin) {
  double most = 0;
  const Eigen::Vector2d low = grid.position(0, 0), high = grid.position(grid.nx - 1, grid.ny - 1);
  for (double y = low.y() + margin; y <= high.y() - margin; y += 1.7)
    for (double x = low.x() + margin; x <= high.x() - margin; x += 1.9) most = std::max(most, std::abs(fit.height({x, y}) - f(x, y)));
  return most;
}

TEST(FitReference, HasNoBiasOnGentlyCurvedMolds) {
  for (const Height& f : {Height(sphere), Height(waves)}) {
    const Grid<float> grid = heights(f, 401, 321, 0.5, 0);
    const Reference fit = fit_reference(grid);
    EXPECT_NEAR(fit.heights().spacing, 4.0, 1e-12);
    EXPECT_LT(worst(fit, grid, f, 0), 0.005);
    EXPECT_TRUE(fit.inside(grid.position(0, 0)));
    EXPECT_TRUE(fit.inside(grid.position(grid.nx - 1, grid.ny - 1)));
  }
}

// Shoulders that no window of 12 mm follows: the slope changes by 1.7 within 6 to 14 mm. Of one that rises by 12 mm
// 300 mm2 are left marked: a window halved once follows it nearly, and the tips of its shoulders count as strays.
TEST(FitReference, FollowsTheShouldersOfAStep) {
  for (const double rise : {10.0, 16.0, 24.0}) {
    const auto step = [rise](double x, double y) {
      const double along = (0.8 * x + 0.6 * y - 7) / (rise / 3.4);
      return 0.5 * rise * along / std::sqrt(1 + along * along);
    };
    const Grid<float> grid = heights(step, 201, 161, 1.0, 0.05);
    const Reference fit = fit_reference(grid);
    EXPECT_LT(worst(fit, grid, step, 4), 0.4) << rise;
    const Grid<std::uint8_t> off = misfits(grid, fit);
    EXPECT_EQ(std::count(off.values.begin(), off.values.end(), 1), 0) << rise;
  }
}

// A spar's fillet of 20 mm radius under a flank of 35 degrees. A ply of 0.13 mm must lie within 0.045 mm on it.
TEST(FitReference, FollowsFilletsAsCloselyAsThinPliesNeed) {
  const auto spar = [](double x, double) {
    const double radius = 20, foot = radius * std::sin(0.61), out = std::max(0.0, std::abs(x) - 30);
    const double up = radius - std::sqrt(radius * radius - std::pow(std::min(out, foot), 2));
    return up + std::tan(0.61) * std::max(0.0, out - foot);
  };
  const Grid<float> grid = heights(spar, 201, 161, 0.7, 0.02);
  EXPECT_LT(worst(fit_reference(grid), grid, spar, 12), 0.06);
}

TEST(FitReference, ReducesNoise) {
  const Grid<float> grid = heights(sphere, 401, 321, 0.5, 0.1);
  const Reference fit = fit_reference(grid);
  double squares = 0;
  int count = 0;
  for (double y = -68; y <= 68; y += 1.7)
    for (double x = -88; x <= 88; x += 1.9) squares += std::pow(fit.height({x, y}) - sphere(x, y), 2), ++count;
  EXPECT_LT(std::sqrt(squares / count), 0.007);
  EXPECT_LT(worst(fit, grid, sphere, 12), 0.03);
  EXPECT_LT(worst(fit, grid, sphere, 0), 0.1);
}

TEST(FitReference, TakesTheWidestWindowThatAgrees) {
  const auto dent = [](double x, double y) { return sphere(x, y) - 0.6 * std::exp(-(x * x + y * y) / (2 * 15.0 * 15.0)); };
  const auto error = [](const Grid<float>& grid, int doublings, const Height& f, double from, double to) {
    const Reference fit = fit_reference(grid, {4.0, 12.0, 6.0, doublings});
    double squares = 0;
    int count = 0;
    for (double y = -68; y <= 68; y += 1.7)
      for (double x = -88; x <= 88; x += 1.9)
        if (const double r = std::hypot(x, y); r >= from && r < to) squares += std::pow(fit.height({x, y}) - f(x, y), 2), ++count;
    return std::sqrt(squares / count);
  };
  const Grid<float> smooth = heights(waves, 401, 321, 0.5, 0.1), dented = heights(dent, 401, 321, 0.5, 0.02);
  EXPECT_LT(error(smooth, 2, waves, 0, 60), 0.6 * error(smooth, 0, waves, 0, 60));
  EXPECT_LT(error(dented, 2, dent, 0, 30), 1.3 * error(dented, 0, dent, 0, 30));      // a detail is kept ...
  EXPECT_LT(error(dented, 2, dent, 60, 100), 0.9 * error(dented, 0, dent, 60, 100));  // ... and the rest is smoother
}

TEST(FitReference, GoesOnSmoothlyOverGapsAndBorders) {
  Grid<float> grid = heights(sphere, 401, 321, 0.5, 0.05);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      if ((p - Eigen::Vector2d(10, -5)).norm() < 30 || p.x() < -80 || p.x() + p.y() > 150) grid.at(i, j) = nanf;
    }
  const Reference fit = fit_reference(grid);
  for (double y = -40; y < 40; y += 3)
    for (double x = -30; x < 50; x += 3) EXPECT_NEAR(fit.height({x, y}), sphere(x, y), 0.1);
  EXPECT_LT(worst(fit, grid, sphere, 0), 0.8);  // a curvature of 1/1000 that is not known 30 mm beyond: 0.45
}

TEST(FitReference, ShrugsOffSpikes) {
  Grid<float> grid = heights(sphere, 401, 321, 0.5, 0.05);
  Noise noise(3);
  for (float& z : grid.values)
    if (noise.uniform() < 0.003) z += 15;
  EXPECT_LT(worst(fit_reference(grid), grid, sphere, 12), 0.03);
}

TEST(FitReference, HasTheSameBitsOnAnyNumberOfThreads) {
  const Grid<float> grid = heights(waves, 201, 161, 1.0, 0.1);
  const Reference one = fit_reference(grid, {}, 1);
  for (const int threads : {2, 4}) EXPECT_EQ(one.heights().values, fit_reference(grid, {}, threads).heights().values);
}

TEST(FitReference, SaysWhenThereIsTooLittle) {
  Grid<float> grid(50, 50, {0, 0}, 1.0, nanf);
  EXPECT_THROW(fit_reference(grid), InputError);
  grid.at(3, 3) = 1;
  try {
    fit_reference(grid);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("heights"), std::string::npos);
  }
  EXPECT_THROW(fit_reference(grid, {-1.0}), InputError);
  EXPECT_THROW(fit_reference(grid, {4.0, 12.0, 6.0, 9}), InputError);
  EXPECT_THROW(fit_reference(Grid<float>(1, 5, {0, 0}, 1.0)), InputError);
  const Grid<float> tiny(2, 2, {0, 0}, 1.0, 5.0f);
  EXPECT_THROW(fit_reference(tiny), InputError);
}

}  // namespace
}  // namespace debulk
