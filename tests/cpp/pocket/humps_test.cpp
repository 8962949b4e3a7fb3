#include "debulk/pocket/humps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace debulk {
namespace {

const double kPi = std::acos(-1.0);

// Heights over 400 mm, 2 mm apart, of a surface with a bell h cos²(π r / 2R) on it.
template <class Surface>
Grid<float> with_bell(const Surface& surface, double x, double y, double radius, double height) {
  Grid<float> out(200, 200, {-200, -200}, 2.0);
  for (int j = 0; j < out.ny; ++j)
    for (int i = 0; i < out.nx; ++i) {
      const Eigen::Vector2d at = out.position(i, j);
      const double far = std::hypot(at.x() - x, at.y() - y) / radius;
      out.at(i, j) = static_cast<float>(surface(at.x(), at.y()) + (far < 1 ? height * std::pow(std::cos(kPi * far / 2), 2) : 0.0));
    }
  return out;
}

double saddle(double x, double y) {
  return 0.0008 * x * x - 0.0003 * y * y;
}

// A round crest with flanks, straight along a direction.
struct Spar {
  double turn;
  double operator()(double x, double y) const {
    const double across = std::abs(std::cos(turn) * x + std::sin(turn) * y), round = std::min(across, 20.0);
    return std::sqrt(900 - round * round) - 30 - 0.9 * std::min(std::max(across - 20, 0.0), 12.0);
  }
};

// By how much the bell's section through its top is longer than its base: the integral of sqrt(1 + h'²) - 1.
double excess_of_bell(double radius, double height) {
  double sum = 0;
  constexpr int kSteps = 20000;
  for (int k = 0; k < kSteps; ++k) {
    const double slope = height * kPi / (2 * radius) * std::sin(kPi * (2.0 * k / kSteps - 1));
    sum += (std::sqrt(1 + slope * slope) - 1) * 2 * radius / kSteps;
  }
  return sum;
}

TEST(Humps, ABellHasItsHeightAreaAndExcess) {
  for (const auto& [radius, height] : {std::pair(25.0, 5.0), std::pair(40.0, 7.0), std::pair(60.0, 9.0)}) {
    const auto humps = find_humps(with_bell(saddle, 10, -6, radius, height), {}, {0.0, 90.0});
    ASSERT_FALSE(humps.empty());
    const Hump& hump =  // of those found twice, the one that was measured from a ring as wide as it is
        *std::max_element(humps.begin(), humps.end(), [](const Hump& a, const Hump& b) { return a.excess < b.excess; });
    EXPECT_LT((hump.top - Eigen::Vector2d(10, -6)).norm(), 4);
    EXPECT_NEAR(hump.height, height, 0.12 * height);                                     // means of cells take a part of a top
    EXPECT_NEAR(hump.area, kPi * radius * radius / 4, 0.2 * kPi * radius * radius / 4);  // half as high at half the radius
    EXPECT_NEAR(hump.excess, excess_of_bell(radius, height), 0.25 * excess_of_bell(radius, height));
  }
}

TEST(Humps, ABellOnASparStandsAboveTheLineAlongIt) {
  for (const double turn : {0.0, 0.47, 2.46}) {
    const Spar spar{turn};
    EXPECT_TRUE(find_humps(with_bell(spar, 0, 0, 20, 0), {}, {0.0}).empty());
    const auto humps = find_humps(with_bell(spar, 12 * std::cos(turn), 12 * std::sin(turn), 20, 4.5), {}, {0.0});
    ASSERT_FALSE(humps.empty());
    EXPECT_LT((humps[0].top - 12 * Eigen::Vector2d(std::cos(turn), std::sin(turn))).norm(), 6);
    EXPECT_NEAR(humps[0].height, 4.5, 0.7);
  }
}

TEST(Humps, RibsStepsAndWhatNobodySawAreNone) {
  EXPECT_TRUE(find_humps(with_bell(saddle, 0, 0, 30, 0.4), {}, {0.0}).empty());
  EXPECT_TRUE(find_humps(with_bell([](double x, double) { return std::abs(x) < 20 ? 6.0 : 0.0; }, 0, 0, 30, 0), {}, {0.0}).empty());
  EXPECT_TRUE(find_humps(with_bell([](double x, double) { return x > 0 ? 6.0 : 0.0; }, 0, 0, 30, 0), {}, {0.0}).empty());
  Grid<float> hidden = with_bell(saddle, 0, 0, 30, 6);
  for (int j = 0; j < hidden.ny; ++j)
    for (int i = 0; i < hidden.nx; ++i)
      if (hidden.position(i, j).norm() < 35) hidden.at(i, j) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(find_humps(hidden, {}, {0.0}).empty());
  EXPECT_TRUE(find_humps(Grid<float>(3, 3, {0, 0}, 2.0), {}, {0.0}).empty());
}

TEST(Humps, OnlyThoseOnThePlyAreFound) {
  const Grid<float> heights = with_bell(saddle, 50, 0, 30, 6);
  EXPECT_TRUE(find_humps(heights, {{-150, -100}, {0, -100}, {0, 100}, {-150, 100}}, {0.0}).empty());
  EXPECT_FALSE(find_humps(heights, {{0, -100}, {150, -100}, {150, 100}, {0, 100}}, {0.0}).empty());
}

TEST(Humps, ARaisedStopEndsTheSearch) {
  const Stop stop;
  stop.cancel();
  EXPECT_THROW(find_humps(with_bell(saddle, 0, 0, 30, 6), {}, {0.0}, stop), Stopped);
}

}  // namespace
}  // namespace debulk
