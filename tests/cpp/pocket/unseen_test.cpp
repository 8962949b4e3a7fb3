// What was not seen of a ply: coverage, holes, and their rims.

#include "debulk/pocket/unseen.hpp"

#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

namespace debulk {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kStep = 2.0;  // mm

// 200 by 160 mm, flat at 0.3 mm, all known.
Overview plain() {
  Overview out;
  out.heights = Grid<float>(101, 81, {-100, -80}, kStep, 0.3F);
  out.measured = out.reference = out.heights.like<std::uint8_t>(1);
  return out;
}

using Where = std::function<bool(const Eigen::Vector2d&)>;

void lose(Overview& overview, const Where& where, bool reference = false) {
  for (int j = 0; j < overview.heights.ny; ++j)
    for (int i = 0; i < overview.heights.nx; ++i) {
      if (!where(overview.heights.position(i, j))) continue;
      overview.heights.at(i, j) = kNan, overview.measured.at(i, j) = 0;
      if (reference) overview.reference.at(i, j) = 0;
    }
}

Where disc(double x, double y, double radius) {
  return [=](const Eigen::Vector2d& p) { return (p - Eigen::Vector2d(x, y)).norm() < radius; };
}

UnseenOptions on(double half_x, double half_y) {
  UnseenOptions options;
  options.ply_outline = Polygon{{-half_x, -half_y}, {half_x, -half_y}, {half_x, half_y}, {-half_x, half_y}};
  return options;
}

TEST(Unseen, NothingIsMissing) {
  const Unseen unseen = find_unseen(plain(), on(90.5, 70.5));
  EXPECT_DOUBLE_EQ(unseen.coverage, 1);
  EXPECT_DOUBLE_EQ(unseen.reference_coverage, 1);
  EXPECT_TRUE(unseen.holes.empty());
  EXPECT_EQ(unseen.smaller, 0);
}

TEST(Unseen, WhatLiesOffTheGridIsUnseen) {
  const Unseen unseen = find_unseen(plain(), on(201, 70.5));  // twice as wide as what is known
  EXPECT_NEAR(unseen.coverage, 0.5, 0.01);
  EXPECT_NEAR(unseen.reference_coverage, 0.5, 0.01);
  ASSERT_EQ(unseen.holes.size(), 2U);
  EXPECT_TRUE(unseen.holes[0].at_ply_edge);
  EXPECT_DOUBLE_EQ(unseen.holes[0].reference_share, 1);
}

TEST(Unseen, AHoleHasPlaceAreaThicknessAndRim) {
  Overview overview = plain();
  lose(overview, disc(20, 10, 25));
  for (int j = 0; j < overview.heights.ny; ++j)
    for (int i = 0; i < overview.heights.nx; ++i)
      if (overview.heights.position(i, j).x() > 38 && !std::isnan(overview.heights.at(i, j))) overview.heights.at(i, j) = 2.0F;
  overview.heights.at(72, 44) = overview.heights.at(73, 45) = 3.0F;  // wild ones beside it
  const Unseen unseen = find_unseen(overview, on(90.5, 70.5));
  ASSERT_EQ(unseen.holes.size(), 1U);
  const UnseenHole& hole = unseen.holes[0];
  EXPECT_NEAR(hole.area, M_PI * 625, 0.05 * M_PI * 625);
  EXPECT_NEAR((hole.centre - Eigen::Vector2d(20, 10)).norm(), 0, 0.5);
  EXPECT_NEAR(hole.thickness, 50, 5);
  EXPECT_NEAR(hole.rim_height, 2.0, 1e-6);
  EXPECT_FALSE(hole.at_ply_edge);
  EXPECT_FALSE(hole.filled);
  EXPECT_DOUBLE_EQ(hole.reference_share, 0);
  EXPECT_NEAR(1 - unseen.coverage, M_PI * 625 / (181 * 141), 0.005);
}

TEST(Unseen, ABentHoleIsNamedByAPointInIt) {
  Overview overview = plain();
  const auto ring = [](const Eigen::Vector2d& p) { return p.norm() > 30 && p.norm() < 44 && p.x() > -30; };
  lose(overview, ring);
  const UnseenHole hole = find_unseen(overview, on(90.5, 70.5)).holes.at(0);
  EXPECT_TRUE(ring(hole.centre));
  EXPECT_LT(hole.centre.norm(), 32);  // nearest to the middle of its area
}

TEST(Unseen, AGapInTheReferenceIsNamed) {
  Overview overview = plain();
  lose(overview, disc(0, 0, 30), true);
  const Unseen unseen = find_unseen(overview, on(90.5, 70.5));
  ASSERT_EQ(unseen.holes.size(), 1U);
  EXPECT_DOUBLE_EQ(unseen.holes[0].reference_share, 1);
  EXPECT_DOUBLE_EQ(unseen.coverage, unseen.reference_coverage);
}

TEST(Unseen, WhatTheRuleFillsIsNoHoleButIsKnownAsFilled) {
  Overview overview = plain();
  lose(overview, disc(0, 0, 9));
  for (float& h : overview.heights.values)
    if (std::isnan(h)) h = 0.3F;
  const Unseen unseen = find_unseen(overview, on(90.5, 70.5));
  EXPECT_DOUBLE_EQ(unseen.coverage, 1);
  ASSERT_EQ(unseen.holes.size(), 1U);
  EXPECT_TRUE(unseen.holes[0].filled);
}

TEST(Unseen, ThinStripsAreSummed) {
  Overview overview = plain();
  lose(overview, [](const Eigen::Vector2d& p) { return std::abs(p.y() - 10) < 1.5 && std::abs(p.x()) < 60; });
  const Unseen unseen = find_unseen(overview, on(90.5, 70.5));
  EXPECT_TRUE(unseen.holes.empty());
  EXPECT_EQ(unseen.smaller, 1);
  EXPECT_GT(unseen.smaller_area, 200);
  EXPECT_LT(unseen.coverage, 1);
}

TEST(Unseen, WithoutAnOutlineTheReferenceStandsForThePly) {
  Overview overview = plain();
  lose(overview, [](const Eigen::Vector2d& p) { return p.x() > 50; }, true);  // no reference there: not expected
  lose(overview, [](const Eigen::Vector2d& p) { return p.x() < -50; });       // the scan ends there
  const Unseen unseen = find_unseen(overview, UnseenOptions());
  EXPECT_NEAR(unseen.coverage, 101.0 / 151, 0.01);
  ASSERT_EQ(unseen.holes.size(), 1U);
  EXPECT_TRUE(unseen.holes[0].at_ply_edge);
}

}  // namespace
}  // namespace debulk
