#include "debulk/surface/reference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

Reference sampled(const std::function<double(double, double)>& f, int nx, int ny, double spacing) {
  Grid<double> heights(nx, ny, {-3.0, 2.0}, spacing);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const Eigen::Vector2d p = heights.position(i, j);
      heights.at(i, j) = f(p.x(), p.y());
    }
  return Reference(heights);
}

double cubic(double x, double y) {
  return 1 + 2 * x - y + 0.3 * x * y + 0.02 * x * x * x - 0.01 * y * y * y + 0.005 * x * x * y;
}

TEST(Reference, ReproducesCubicsExactlyWithTheirDerivatives) {
  for (const auto& [nx, ny] : {std::pair{4, 4}, std::pair{5, 9}, std::pair{30, 12}}) {
    const Reference surface = sampled(cubic, nx, ny, 0.7);
    for (double u = 0.0; u <= 1.0; u += 0.13) {
      const Eigen::Vector2d p(-3.0 + u * 0.7 * (nx - 1), 2.0 + (1 - u) * 0.7 * (ny - 1));
      const double x = p.x(), y = p.y();
      const SurfaceSample s = surface.sample(p);
      EXPECT_NEAR(s.height, cubic(x, y), 1e-11);
      EXPECT_NEAR(s.gradient.x(), 2 + 0.3 * y + 0.06 * x * x + 0.01 * x * y, 1e-10);
      EXPECT_NEAR(s.gradient.y(), -1 + 0.3 * x - 0.03 * y * y + 0.005 * x * x, 1e-10);
      EXPECT_NEAR(s.hessian(0, 0), 0.12 * x + 0.01 * y, 1e-9);
      EXPECT_NEAR(s.hessian(0, 1), 0.3 + 0.01 * x, 1e-9);
      EXPECT_EQ(s.hessian(0, 1), s.hessian(1, 0));
      EXPECT_NEAR(s.hessian(1, 1), -0.06 * y, 1e-9);
    }
  }
}

TEST(Reference, ConvergesAtFourthOrder) {
  const auto wave = [](double x, double y) { return std::sin(0.8 * x) * std::cos(0.6 * y); };
  double previous = 0;
  for (const int n : {20, 40, 80}) {
    const double spacing = 10.0 / (n - 1);
    const Reference surface = sampled(wave, n, n, spacing);
    double error = 0;
    for (double x = -3; x <= 7; x += 0.0931)
      for (double y = 2; y <= 12; y += 0.117) error = std::max(error, std::abs(surface.height({x, y}) - wave(x, y)));
    if (previous > 0) {
      EXPECT_GT(previous / error, 12) << "n = " << n;
    }
    previous = error;
  }
}

TEST(Reference, DerivativesAgreeWithFiniteDifferencesInsideAndOutside) {
  const Reference surface = sampled([](double x, double y) { return std::sin(x) + std::cos(1.3 * y) * x; }, 12, 10, 0.9);
  const double h = 1e-5;
  for (double x = -7; x <= 12; x += 0.77)
    for (double y = -3; y <= 15; y += 0.83) {
      const SurfaceSample s = surface.sample({x, y});
      const SurfaceSample e = surface.sample({x + h, y}), w = surface.sample({x - h, y});
      const SurfaceSample n = surface.sample({x, y + h}), b = surface.sample({x, y - h});
      const double scale = 1 + std::abs(s.height);
      EXPECT_NEAR(s.gradient.x(), (e.height - w.height) / (2 * h), 1e-8 * scale);
      EXPECT_NEAR(s.gradient.y(), (n.height - b.height) / (2 * h), 1e-8 * scale);
      EXPECT_NEAR(s.hessian(0, 0), (e.gradient.x() - w.gradient.x()) / (2 * h), 2e-4 * scale);
      EXPECT_NEAR(s.hessian(0, 1), (e.gradient.y() - w.gradient.y()) / (2 * h), 2e-4 * scale);
      EXPECT_NEAR(s.hessian(1, 1), (n.gradient.y() - b.gradient.y()) / (2 * h), 2e-4 * scale);
    }
}

TEST(Reference, GoesOnAtMostLinearlyOutside) {
  const Reference surface = sampled([](double x, double y) { return x * x - y * y; }, 8, 8, 1.0);
  EXPECT_FALSE(surface.inside({-3.1, 5.0}));
  EXPECT_TRUE(surface.inside({-3.0, 2.0}));
  EXPECT_TRUE(surface.inside({4.0, 9.0}));
  const double far = surface.height({-1003.0, 5.0}), farther = surface.height({-2003.0, 5.0}), farthest = surface.height({-3003.0, 5.0});
  EXPECT_NEAR(farther - far, farthest - farther, 1e-6);
}

TEST(Reference, TellsHeightsAloneToTheSameBits) {
  const Reference surface = sampled(cubic, 9, 11, 0.7);
  Grid<double> grid(60, 70, {-5.0, 0.5}, 0.17);  // beyond it, too
  surface.heights_on(grid, 2);
  for (int j = 0; j < grid.ny; ++j)
    for (int i = 0; i < grid.nx; ++i) {
      const Eigen::Vector2d p = grid.position(i, j);
      ASSERT_EQ(surface.height(p), surface.sample(p).height);
      ASSERT_EQ(grid.at(i, j), surface.sample(p).height);
    }
}

// Rows of nothing are not looked at, eight at a time: the spline beside them comes out as if they were.
TEST(Reference, IsTheSameWhereRowsAreAllZero) {
  Grid<double> heights(11, 40, {0, 0}, 1.0), turned(40, 11, {0, 0}, 1.0);
  for (int j = 19; j < 23; ++j)
    for (int i = 3; i < 8; ++i) heights.at(i, j) = turned.at(j, i) = 1 + 0.3 * i + 0.1 * j * j;
  const Reference surface(heights), other(turned);
  for (double y = -1; y < 41; y += 0.37)
    for (double x = -1; x < 12; x += 0.41) EXPECT_NEAR(surface.height({x, y}), other.height({y, x}), 1e-12);
}

TEST(Reference, TellsTheGradientsOnARowAsPointByPoint) {
  const Reference surface = sampled(cubic, 9, 11, 0.7);
  const std::vector<double> within{-3.0, -2.9, -2.3, -1.6, -1.1, -0.9, -0.2, 0.4, 1.2, 1.9, 2.59};
  const std::vector<double> beyond{-5.0, -3.0, -2.9, -1.1, 0.4, 2.6, 2.61, 7.5};
  for (const std::vector<double>& x : {within, beyond})
    for (const double y : {0.5, 2.0, 4.44, 9.0, 11.0}) {
      const std::vector<Eigen::Vector2d> row = surface.gradients_on_row(x, y);
      ASSERT_EQ(row.size(), x.size());
      for (std::size_t k = 0; k < x.size(); ++k) EXPECT_LT((row[k] - surface.sample({x[k], y}).gradient).norm(), 1e-11) << x[k] << " " << y;
    }
  EXPECT_TRUE(surface.gradients_on_row({}, 3.0).empty());
}

TEST(Reference, NamesWhatIsWrongWithItsGrid) {
  EXPECT_THROW(Reference(Grid<double>(3, 9, {0, 0}, 1.0, 0.0)), InputError);
  EXPECT_THROW(Reference(Grid<double>(4, 4, {0, 0}, 0.0, 0.0)), InputError);
  EXPECT_THROW(Reference(Grid<double>(4, 4, {0, 0}, -1.0, 0.0)), InputError);
  Grid<double> holed(5, 5, {0, 0}, 1.0, 0.0);
  holed.at(3, 2) = std::numeric_limits<double>::quiet_NaN();
  try {
    Reference surface(holed);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("row 2, column 3"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace debulk
