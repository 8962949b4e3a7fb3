#include "debulk/pocket/outline_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace debulk {
namespace {

TEST(OutlineSearch, TellsThePolygonsOwnBits) {
  Polygon outline;
  std::mt19937 random(3);
  const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(random()) / 4294967295.0; };
  for (int k = 0; k < 500; ++k) {
    const double angle = 2 * std::acos(-1.0) * k / 500, r = uniform(60, 100);
    outline.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  const OutlineSearch search(outline);
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector2d p(uniform(-120, 120), uniform(-120, 120));
    EXPECT_EQ(search.inside(p), inside(outline, p));
    EXPECT_EQ(search.distance(p), distance_to_outline(outline, p));
    EXPECT_EQ((search.nearest_point(p) - p).norm(), search.distance(p));
    EXPECT_NEAR(distance_to_outline(outline, search.nearest_point(p)), 0, 1e-12);
    for (const double reach : {0.0, 5.0, distance_to_outline(outline, p)})
      EXPECT_EQ(search.within(p, reach), distance_to_outline(outline, p) <= reach);
    // Straight on from inside: what lies before the way out is inside, what lies behind it is not.
    const double turn = uniform(0, 6.3), way = search.way_out(p, {std::cos(turn), std::sin(turn)});
    const auto on = [&](double along) { return Eigen::Vector2d(p + along * Eigen::Vector2d(std::cos(turn), std::sin(turn))); };
    if (!inside(outline, p)) {
      EXPECT_EQ(way, 0);
      continue;
    }
    EXPECT_FALSE(inside(outline, on(way + 1e-6)));
    for (int part = 0; part < 20; ++part) EXPECT_TRUE(inside(outline, on((way - 1e-6) * part / 20)));
  }
  EXPECT_TRUE(std::isinf(OutlineSearch().distance({0, 0})));
}

}  // namespace
}  // namespace debulk
