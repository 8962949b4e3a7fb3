// What of a free rim is held where friction does all it can.
#include <gtest/gtest.h>

#include <cmath>

#include "debulk/net/edge_ways.hpp"
#include "debulk/net/held_rim.hpp"
#include "debulk/pocket/polygon.hpp"
#include "support/shapes.hpp"

namespace debulk {
namespace {

// Round a bell of radius 30 that the ply's edge cuts at x = 12, with fibres along x and y.
PocketNet at_the_edge(const Polygon& ply_outline) {
  const test::Plane mold;
  const test::Bell ply(mold, 5.0, 30.0);
  PocketShape shape;
  shape.angles = {0.0, M_PI / 2};
  for (int k = 0; k < 48; ++k) shape.outline.emplace_back(30 * std::cos(k * M_PI / 24), 30 * std::sin(k * M_PI / 24));
  shape.ply_outline = ply_outline;
  FibreNetOptions options;
  options.spacing = 5.0;
  return fibre_net(ply, mold, shape, options);
}

const Polygon kCut = {{-200, -200}, {12, -200}, {12, 200}, {-200, 200}};

TEST(HeldRim, HoldsTheFibresThatRunOnBesideTheEdge) {
  const PocketNet laid = at_the_edge(kCut), held = with_rim_held(laid);
  int beside = 0, cut = 0;
  for (std::size_t i = 0; i < laid.net.nodes.size(); ++i) {
    if (laid.net.kinds[i] != NodeKind::free) {
      EXPECT_EQ(held.net.kinds[i], laid.net.kinds[i]);
      EXPECT_EQ(held.net.to_edge[i], laid.net.to_edge[i]);
      continue;
    }
    const bool ends_along_y = laid.net.neighbours[i][north] < 0 || laid.net.neighbours[i][south] < 0;
    EXPECT_EQ(held.net.kinds[i], ends_along_y ? NodeKind::fixed : NodeKind::free) << laid.net.nodes[i].transpose();
    (ends_along_y ? beside : cut)++;
    EXPECT_GE(held.net.to_edge[i], laid.net.to_edge[i]);
  }
  EXPECT_GE(beside, 4);
  EXPECT_GE(cut, 4);
  EXPECT_EQ(held.net.nodes.size(), laid.net.nodes.size());
  EXPECT_EQ(held.net.nodes[3], laid.net.nodes[3]);
}

Polygon cut_at(double x, double turn) {
  Polygon out;
  for (const Eigen::Vector2d& c : {Eigen::Vector2d(-200, -200), {x, -200}, {x, 200}, {-200, 200}})
    out.emplace_back(std::cos(turn) * c.x() - std::sin(turn) * c.y(), std::sin(turn) * c.x() + std::cos(turn) * c.y());
  return out;
}

TEST(HeldRim, HoldsNoNodeThatStandsOffTheMold) {
  // Held in the air it would be a ridge of its own. Fibres at any angle to the edge, and some that leave the ply nearly along it.
  std::vector<Polygon> plies;
  for (const double turn : {0.1, 0.4, 0.785, 1.2, 1.5}) plies.push_back(cut_at(12, turn));
  for (double x = 9.92; x < 10; x += 0.01) plies.push_back(cut_at(x, 0));
  int tempting = 0;  // nodes in the air from which it is farther to the edge than the spacing
  for (const Polygon& ply : plies) {
    const PocketNet laid = at_the_edge(ply), held = with_rim_held(laid);
    const std::vector<double> past = ways_past_ends(laid.net, ply);
    int fixed = 0;
    for (std::size_t i = 0; i < laid.net.nodes.size(); ++i) {
      if (laid.net.kinds[i] != NodeKind::free) continue;
      const bool in_the_air = laid.net.nodes[i].z() > 0.5;
      tempting += in_the_air && past[i] > laid.net.spacing;
      fixed += held.net.kinds[i] == NodeKind::fixed;
      EXPECT_FALSE(in_the_air && held.net.kinds[i] == NodeKind::fixed) << laid.net.nodes[i].transpose();
    }
    EXPECT_GE(fixed, 2);
  }
  EXPECT_GE(tempting, 1);
}

TEST(HeldRim, LeavesANetAsItIsWhoseEdgeIsNotKnown) {
  const PocketNet laid = at_the_edge({}), held = with_rim_held(laid);
  EXPECT_EQ(held.net.kinds, laid.net.kinds);
  EXPECT_TRUE(held.net.to_edge.empty());
}

}  // namespace
}  // namespace debulk
