#include "debulk/surface/gridding.hpp"

#include <gtest/gtest.h>

#include "debulk/core/error.hpp"
#include "scene.hpp"

namespace debulk {
namespace {

using namespace testing;

double plane(double x, double y) {
  return 3 + 0.3 * x - 0.2 * y;
}

struct Errors {
  double mean = 0, rms = 0, worst = 0;
  int count = 0, missing = 0;
};

Errors errors(const Grid<float>& grid, const Height& truth) {
  Errors e;
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      if (std::isnan(grid.at(i, j))) {
        ++e.missing;
        continue;
      }
      const Eigen::Vector2d p = grid.position(i, j);
      const double off = grid.at(i, j) - truth(p.x(), p.y());
      e.mean += off, e.rms += off * off, e.worst = std::max(e.worst, std::abs(off)), ++e.count;
    }
  e.mean /= e.count, e.rms = std::sqrt(e.rms / e.count);
  return e;
}

Grid<float> inner(double half, double spacing) {
  return covering_grid({-half, -half}, {half, half}, spacing);
}

TEST(Gridding, ReproducesAPlaneAtEverySpacing) {
  const Scan cloud = scan(plane, 160, 140, 0.8, 0, 1);
  for (const double spacing : {0.31, 0.8, 1.1, 1.7, 2.9, 4.0})
    for (const CloudView& view : {cloud.view(), cloud.flat()}) {
      Grid<float> grid = inner(40, spacing);
      grid_heights(view, grid);
      const Errors e = errors(grid, plane);
      EXPECT_EQ(e.missing, 0) << spacing;
      EXPECT_LT(e.worst, 2e-4) << spacing;  // float coordinates
    }
}

TEST(Gridding, LeavesNoGapBetweenSquares) {
  // Points every 0.5 mm and grid points on their sides, diagonals and corners; then the same turned and moved far away, and
  // beside a tile whose points are spread over metres.
  for (const double turned : {0.0, 0.4})
    for (const bool spread : {false, true}) {
      const Eigen::Rotation2Dd rotation(turned);
      const Eigen::Vector2d far(turned * 5000, -turned * 7000);
      Scan cloud = scan(plane, 140, 140, 0.5, 0, 1);
      for (int j = 0; j < 140; ++j)
        for (int i = 0; i < 140; ++i) {
          float* p = &cloud.xyz[3 * (static_cast<std::size_t>(j) * 140 + static_cast<std::size_t>(i))];
          const Eigen::Vector2d xy = rotation * Eigen::Vector2d(0.5 * (i - 70), 0.5 * (j - 70)) + far;
          p[0] = static_cast<float>(xy.x()), p[1] = static_cast<float>(xy.y()), p[2] = static_cast<float>(plane(p[0], p[1]));
          if (spread && i == 3 && j % 32 == 3) p[0] += 3000;  // of the first column of tiles
        }
      for (const double spacing : {0.25, 0.125, 1.5}) {
        const Eigen::Vector2d half(20, 20);
        Grid<float> grid = covering_grid(far - half, far + half, spacing);
        grid_heights(cloud.view(), grid);
        const Errors e = errors(grid, plane);
        EXPECT_EQ(e.missing, 0) << turned << spread << spacing;
        EXPECT_LT(e.worst, 2e-3) << turned << spread << spacing;  // float coordinates, metres away
      }
    }
}

TEST(Gridding, AveragesNoiseOnACoarseGridWithoutSlopeBias) {
  const Scan cloud = scan(plane, 500, 460, 0.25, 0.1, 2);
  for (const CloudView& view : {cloud.view(), cloud.flat()}) {
    Grid<float> grid = inner(40, 1.0);
    grid_heights(view, grid);
    const Errors e = errors(grid, plane);
    EXPECT_LT(e.rms, 0.04);
    EXPECT_LT(std::abs(e.mean), 0.002);
  }
}

TEST(Gridding, SaysHowMuchItBlurs) {
  const double curvature = 1.0 / 400;
  const Height top = [&](double x, double y) { return -curvature * (x * x + y * y) / 2; };
  const Scan cloud = scan(top, 240, 240, 0.5, 0, 1);
  for (const double spacing : {0.5, 1.0, 2.0}) {
    Grid<float> grid = inner(40, spacing);
    const double blur = grid_heights(cloud.flat(), grid);
    EXPECT_NEAR(errors(grid, top).mean, -curvature * blur, 0.1 * curvature * blur) << spacing;
  }
}

TEST(Gridding, LeavesNoSlopeBiasBesideMissingHalves) {
  Scan cloud = scan(plane, 400, 300, 0.3, 0, 3);
  for (int j = 0; j < 300; ++j)
    for (int i = 0; i < 400; ++i)
      if ((i / 37 + j / 23) % 3 == 0) cloud.xyz[3 * static_cast<std::size_t>(j * 400 + i)] = nanf;
  for (const CloudView& view : {cloud.view(), cloud.flat()}) {
    Grid<float> grid = inner(35, 1.3);
    grid_heights(view, grid);
    const Errors e = errors(grid, plane);
    EXPECT_GT(e.missing, 500);
    EXPECT_LT(e.worst, 2e-4);
  }
}

TEST(Gridding, BridgesSinglePixelsButNeitherHolesNorJumps) {
  const Height step = [](double x, double) { return x < 0.2 ? 0.0 : 9.0; };
  Scan cloud{40, 40, {}};
  for (int j = 0; j < 40; ++j)
    for (int i = 0; i < 40; ++i)
      for (const double v : {i - 20.0, j - 20.0, step(i - 20.0, j - 20.0)}) cloud.xyz.push_back(static_cast<float>(v));
  const auto drop = [&](int x, int y) { cloud.xyz[3 * static_cast<std::size_t>((y + 20) * 40 + x + 20)] = nanf; };
  drop(-10, -10);
  for (int y = -2; y < 2; ++y)
    for (int x = -12; x < -8; ++x) drop(x, y);
  Grid<float> grid = inner(18, 0.5);
  grid_heights(cloud.view(), grid);
  const auto at = [&](double x, double y) {
    const Eigen::Vector2d u = grid.locate({x, y});
    return grid.at(static_cast<int>(std::lround(u.x())), static_cast<int>(std::lround(u.y())));
  };
  EXPECT_EQ(at(-10, -10), 0);
  EXPECT_EQ(at(-10.5, -10), 0);
  EXPECT_TRUE(std::isnan(at(-10, 0)));
  EXPECT_EQ(at(0, 5), 0);
  EXPECT_TRUE(std::isnan(at(0.5, 5)));
  EXPECT_EQ(at(1, 5), 9);
}

TEST(Gridding, TakesTheHighestWhereSurfacesOverlap) {
  Scan cloud{41, 20, {}};
  for (int j = 0; j < 20; ++j)
    for (int i = 0; i < 41; ++i)  // goes right, folds over at i = 20 and comes back above
      for (const double v : {i < 20 ? 1.0 * i : 40.0 - i, 1.0 * j, i < 20 ? 0.0 : 2.0}) cloud.xyz.push_back(static_cast<float>(v));
  Grid<float> grid = covering_grid({1, 1}, {17, 17}, 1.0);
  grid_heights(cloud.view(), grid);
  for (const float z : grid.values) EXPECT_EQ(z, 2.0f);
}

TEST(Gridding, HasTheSameBitsOnAnyNumberOfThreads) {
  Scan cloud = scan(mold, 300, 260, 0.7, 0.1, 4);
  Noise noise(5);
  for (std::size_t i = 0; i < cloud.view().size(); ++i)
    if (noise.uniform() < 0.05) cloud.xyz[3 * i + 1] = nanf;
  for (const CloudView& view : {cloud.view(), cloud.flat()})
    for (const double spacing : {0.5, 2.0}) {
      Grid<float> one = inner(70, spacing);
      grid_heights(view, one, {}, 1);
      for (const int threads : {2, 4}) {
        Grid<float> other = inner(70, spacing);
        grid_heights(view, other, {}, threads);
        for (std::size_t k = 0; k < one.size(); ++k)
          ASSERT_TRUE(one.values[k] == other.values[k] || (std::isnan(one.values[k]) && std::isnan(other.values[k])));
      }
    }
}

TEST(Gridding, OfNothingIsNothing) {
  Grid<float> grid = inner(3, 1.0);
  const std::vector<float> missing(30, nanf);
  grid_heights({missing.data(), 5, 2}, grid);
  for (const float z : grid.values) EXPECT_TRUE(std::isnan(z));
  grid_heights({missing.data(), 10, 1}, grid);
  for (const float z : grid.values) EXPECT_TRUE(std::isnan(z));
}

TEST(CoveringGrid, LiesOnMultiplesOfItsSpacingInsideTheBox) {
  const Grid<float> grid = covering_grid({-1.2, 3.1}, {2.6, 4.6}, 0.5);
  EXPECT_EQ(grid.nx, 8);
  EXPECT_EQ(grid.ny, 3);
  EXPECT_EQ(grid.origin, Eigen::Vector2d(-1, 3.5));
  EXPECT_THROW(covering_grid({0, 0}, {1e6, 1e6}, 0.5), InputError);
  EXPECT_THROW(covering_grid({0, 0}, {-5, 5}, 0.5), InputError);
  EXPECT_THROW(covering_grid({0, 0}, {5, 5}, 0), InputError);
}

}  // namespace
}  // namespace debulk
