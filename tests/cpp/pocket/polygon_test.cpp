#include "debulk/pocket/polygon.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/pocket/outline_search.hpp"

namespace debulk {
namespace {

const Polygon kL = {{0, 0}, {4, 0}, {4, 1}, {1, 1}, {1, 3}, {0, 3}};  // area 4 + 2

TEST(Polygon, AreaIsSignedAndCentroidIsOfTheArea) {
  EXPECT_DOUBLE_EQ(polygon_area(kL), 6.0);
  EXPECT_DOUBLE_EQ(polygon_area(Polygon(kL.rbegin(), kL.rend())), -6.0);
  const Eigen::Vector2d c = polygon_centroid(kL);
  EXPECT_NEAR(c.x(), (4 * 2.0 + 2 * 0.5) / 6, 1e-14);
  EXPECT_NEAR(c.y(), (4 * 0.5 + 2 * 2.0) / 6, 1e-14);
  EXPECT_DOUBLE_EQ(polygon_perimeter(kL), 14.0);
  EXPECT_EQ(polygon_area({}), 0.0);
  EXPECT_EQ(polygon_area({{1, 2}, {3, 4}}), 0.0);
  EXPECT_EQ(polygon_centroid({{1, 2}, {3, 4}}), Eigen::Vector2d(2, 3));
}

TEST(Polygon, AreaKeepsItsDigitsFarFromTheOrigin) {
  Polygon far;
  for (const Eigen::Vector2d& p : kL) far.push_back(1e-3 * p + Eigen::Vector2d(131072, -131072));
  EXPECT_NEAR(polygon_area(far) / 6e-6, 1.0, 1e-6);
}

TEST(Polygon, InsideAndDistanceAgreeWithTheShape) {
  EXPECT_TRUE(inside(kL, {0.5, 2.5}));
  EXPECT_TRUE(inside(kL, {3.5, 0.5}));
  EXPECT_FALSE(inside(kL, {2, 2}));
  EXPECT_FALSE(inside(kL, {-1, 1}));
  EXPECT_FALSE(inside(kL, {5, 1}));
  EXPECT_NEAR(distance_to_outline(kL, {2, 2}), 1.0, 1e-15);
  EXPECT_NEAR(distance_to_outline(kL, {7, 5}), 5.0, 1e-15);
  EXPECT_NEAR(distance_to_outline(kL, {0.25, 2}), 0.25, 1e-15);
  EXPECT_TRUE(std::isinf(distance_to_outline({}, {0, 0})));
  EXPECT_EQ(bounding_box(kL).high, Eigen::Vector2d(4, 3));
}

TEST(Polygon, DeepestPointIsTheCentreOfTheLargestCircleInside) {
  // In the corner of the L a circle touches both outer sides and the inner corner (1, 1): (1 - r) sqrt 2 = r.
  const double r = std::sqrt(2.0) / (1 + std::sqrt(2.0));
  const Eigen::Vector2d p = deepest_point(kL);
  EXPECT_NEAR(p.x(), r, 5e-3);
  EXPECT_NEAR(p.y(), r, 5e-3);
  EXPECT_TRUE(inside(kL, p));
}

TEST(Polygon, RingsAreCutOutWithoutASideBetweenThem) {
  const Polygon ply{{0, 0}, {10, 0}, {10, 10}, {0, 10}, {0, 0}, {4, 4}, {4, 6}, {6, 6}, {6, 4}, {4, 4}, {1, 7}, {1, 9}, {3, 9}, {1, 7}};
  const auto ends = [](const Polygon& polygon) {
    std::vector<std::pair<std::size_t, std::size_t>> out;
    for (const Ring& ring : rings(polygon)) out.emplace_back(ring.begin, ring.end);
    return out;
  };
  using Ends = decltype(ends(ply));
  EXPECT_EQ(ends(ply), (Ends{{0, 4}, {5, 9}, {10, 13}}));
  EXPECT_EQ(ends(kL), (Ends{{0, 6}}));
  EXPECT_EQ(ends({{0, 0}, {2, 0}, {2, 2}, {0, 0}, {-2, -2}, {-2, 0}}), (Ends{{0, 6}}));  // it touches itself at its first corner
  EXPECT_EQ(ends({}), Ends{});
  EXPECT_DOUBLE_EQ(polygon_area(ply), 100 - 4 - 2);
  EXPECT_DOUBLE_EQ(polygon_perimeter(ply), 40 + 8 + 4 + std::sqrt(8.0));
  EXPECT_EQ(checked_polygon(ply, "ply_outline"), ply);
  Polygon slit = ply;  // joined by slits and back where it began, it is the same
  slit.push_back(ply[0]);
  EXPECT_EQ(checked_polygon(slit, "ply_outline"), ply);
  const OutlineSearch search(ply);
  for (const auto& [place, on] : {std::pair<Eigen::Vector2d, bool>{{2, 2}, true}, {{5, 5}, false}, {{1.5, 8.5}, false}, {{5, 8}, true}}) {
    EXPECT_EQ(inside(ply, place), on);
    EXPECT_EQ(search.inside(place), on);
    EXPECT_EQ(search.distance(place), distance_to_outline(ply, place));
  }
  EXPECT_NEAR(distance_to_outline(ply, {2, 2}), 2, 1e-15);  // to the outside, past the way from ring to ring
  EXPECT_NEAR(distance_to_outline(ply, {5, 5}), 1, 1e-15);
  EXPECT_NEAR(search.way_out({1, 5}, {1, 0}), 3, 1e-12);
  EXPECT_NEAR(search.way_out({2, 2}, {1, 0}), 8, 1e-12);
}

TEST(Polygon, IsCheckedAndTurnedCounterClockwise) {
  const Polygon clockwise = {{0, 0}, {0, 1}, {1, 0}, {0, 0}};
  const Polygon out = checked_polygon(clockwise, "ply_outline");
  EXPECT_EQ(out.size(), 3u);
  EXPECT_GT(polygon_area(out), 0);
  EXPECT_THROW(checked_polygon({{0, 0}, {1, 1}}, "ply_outline"), InputError);
  EXPECT_THROW(checked_polygon({{0, 0}, {1, 1}, {2, 2}}, "ply_outline"), InputError);
  EXPECT_THROW(checked_polygon({{0, 0}, {1, 0}, {0, std::nan("")}}, "ply_outline"), InputError);
}

}  // namespace
}  // namespace debulk
