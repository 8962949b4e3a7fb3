#include <gtest/gtest.h>

#include <cmath>

#include "debulk/net/edge_ways.hpp"
#include "debulk/net/fibre_net.hpp"
#include "support/shapes.hpp"

namespace debulk {
namespace {

const Polygon kPly = {{-100, -50}, {140, -50}, {140, 70}, {-100, 70}};

TEST(EdgeWays, OfASquareNetOnARectangle) {
  const Net net = test::flat_net(5, 4, 10.0);  // x 0 to 40, y 0 to 30
  const std::vector<double> nearest = ways_to_edge(net, kPly);
  const auto along = ways_along_fibres(net, kPly);
  for (std::size_t i = 0; i < net.nodes.size(); ++i) {
    const double x = net.nodes[i].x(), y = net.nodes[i].y();
    EXPECT_NEAR(nearest[i], std::min({x + 100, 140 - x, y + 50, 70 - y}), 1e-12);
    EXPECT_NEAR(along[i][0], 100, 1e-12);  // of 100 on one side and 100 on the other
    EXPECT_NEAR(along[i][1], 40, 1e-12);   // of 50 and 40
  }
}

TEST(EdgeWays, GoStraightOnAlongATurnedFibre) {
  Net net = test::flat_net(3, 3, 10.0);
  const double turn = 0.5;
  for (Eigen::Vector3d& p : net.nodes)
    p = {std::cos(turn) * p.x() - std::sin(turn) * p.y(), std::sin(turn) * p.x() + std::cos(turn) * p.y(), 0};
  const Eigen::Vector3d end = net.nodes[2];
  const double forward = std::min((140 - end.x()) / std::cos(turn), (70 - end.y()) / std::sin(turn));
  const double back = std::min(100 / std::cos(turn), 50 / std::sin(turn));
  EXPECT_NEAR(ways_along_fibres(net, kPly)[1][0], std::min(forward, back), 1e-10);
}

TEST(EdgeWays, AreNoneWhereNothingLiesBeyondTheFibre) {
  Net net = test::flat_net(3, 3, 10.0);
  for (Eigen::Vector3d& p : net.nodes) p.x() += 120.5;  // the last column stands past the edge
  EXPECT_EQ(ways_along_fibres(net, kPly)[0][0], 0);
  Net single;
  single.nodes = {{0, 0, 0}};
  single.neighbours = {{-1, -1, -1, -1}};
  EXPECT_EQ(ways_along_fibres(single, kPly)[0], (std::array<double, 2>{0, 0}));
}

TEST(EdgeWays, PastAnEndAreThoseOfTheFibresThatEndThere) {
  const Net net = test::flat_net(5, 4, 10.0);  // x 0 to 40, y 0 to 30; numbered row by row
  const std::vector<double> past = ways_past_ends(net, kPly);
  EXPECT_NEAR(past[0], 100, 1e-12);   // a corner: of 100 to the left and 50 down the longer
  EXPECT_NEAR(past[2], 50, 1e-12);    // the lower side: down
  EXPECT_NEAR(past[9], 100, 1e-12);   // the right side: on to the right, however near the upper edge is
  EXPECT_NEAR(past[17], 40, 1e-12);   // the upper side: up
  EXPECT_NEAR(past[19], 100, 1e-12);  // the corner at (40, 30)
  EXPECT_EQ(past[6], 0);              // both fibres go on within the net
}

TEST(EdgeWays, ComeWithANetWhoseEdgeIsKnown) {
  const test::Plane mold;
  const test::Bell ply(mold, 5.0, 30.0);
  PocketShape shape;
  shape.angles = {0.0, M_PI / 2};
  for (int k = 0; k < 48; ++k) shape.outline.emplace_back(30 * std::cos(k * M_PI / 24), 30 * std::sin(k * M_PI / 24));
  EXPECT_TRUE(fibre_net(ply, mold, shape).net.to_edge.empty());
  EXPECT_TRUE(fibre_net(ply, mold, shape).hold_ways.empty());
  EXPECT_TRUE(fibre_net(ply, mold, shape).past_ends.empty());
  shape.ply_outline = kPly;
  const PocketNet laid = fibre_net(ply, mold, shape);
  ASSERT_FALSE(laid.held_all_round());
  ASSERT_EQ(laid.net.to_edge.size(), laid.net.nodes.size());
  ASSERT_EQ(laid.hold_ways.size(), laid.net.nodes.size());
  ASSERT_EQ(laid.past_ends.size(), laid.net.nodes.size());
  for (Eigen::Vector2d& p : shape.ply_outline) p *= 3;  // so far away that no node is free: nobody asks for what lies past an end
  const PocketNet held = fibre_net(ply, mold, shape);
  ASSERT_TRUE(held.held_all_round());
  EXPECT_EQ(held.hold_ways.size(), held.net.nodes.size());
  EXPECT_TRUE(held.past_ends.empty());
}

}  // namespace
}  // namespace debulk
