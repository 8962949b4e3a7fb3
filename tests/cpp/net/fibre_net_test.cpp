#include "debulk/net/fibre_net.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <set>
#include <string>

#include "debulk/net/area.hpp"
#include "debulk/net/beyond_edge.hpp"
#include "debulk/pocket/polygon.hpp"
#include "message.hpp"
#include "surfaces.hpp"

namespace debulk::fibre_net_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const double kPi = std::acos(-1.0);

Polygon ellipse(double a, double b, double turn = 0, const Vector2d& centre = {0, 0}, int corners = 200) {
  Polygon out;
  for (int k = 0; k < corners; ++k) {
    const double t = 2 * kPi * k / corners;
    out.push_back(centre + Eigen::Rotation2Dd(turn) * Vector2d(a * std::cos(t), b * std::sin(t)));
  }
  return out;
}

Polygon rectangle(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

// A disc with a wavy rim, seen from a point of it.
Polygon wavy(double radius, double wave, int lobes) {
  Polygon out;
  for (int k = 0; k < 300; ++k) {
    const double t = 2 * kPi * k / 300;
    const double r = radius * (1 + wave * std::cos(lobes * t));
    out.push_back(r * Vector2d(std::cos(t), std::sin(t)));
  }
  return out;
}

PocketShape shape_of(const Polygon& outline, const FibreAngles& angles = {0, kPi / 2}) {
  PocketShape shape;
  shape.outline = outline;
  shape.angles = angles;
  return shape;
}

FibreNetOptions with_spacing(double spacing) {
  FibreNetOptions options;
  options.spacing = spacing;
  return options;
}

bool misses_a_neighbour(const Net& net, std::size_t i) {
  return *std::min_element(net.neighbours[i].begin(), net.neighbours[i].end()) < 0;
}

void expect_sound(const PocketNet& pocket, const Surface& ply) {
  const Net& net = pocket.net;
  const std::size_t n = net.nodes.size();
  ASSERT_GT(n, 0u);
  ASSERT_TRUE(net.neighbours.size() == n && net.kinds.size() == n && net.inside.size() == n && net.lattice.size() == n);
  for (const auto& [a, b] : segments(net.neighbours)) EXPECT_NEAR((net.nodes[a] - net.nodes[b]).norm() / net.spacing, 1, 1e-9);
  for (const Vector3d& p : net.nodes) EXPECT_NEAR(p.z(), ply.height(p.head<2>()), 1e-11);
  std::set<int> reached{0};
  std::vector<int> open{0};
  while (!open.empty()) {
    const int i = open.back();
    open.pop_back();
    for (const int j : net.neighbours[i])
      if (j >= 0 && reached.insert(j).second) open.push_back(j);
  }
  EXPECT_EQ(reached.size(), n);
  EXPECT_EQ(std::count(net.lattice.begin(), net.lattice.end(), std::array<int, 2>{0, 0}), 1);
}

TEST(FibreNet, OfAnInteriorPocketIsClosedByFixedNodes) {
  const exact::Bell bell(12, 50, 1.4);
  const exact::Plane mold;
  // The outline at the foot; the bell falls below the mold tolerance just inside it.
  const PocketShape shape = shape_of(ellipse(70, 50), {0.3, 1.8});
  const PocketNet pocket = fibre_net(bell, mold, shape);
  expect_sound(pocket, bell);
  const Net& net = pocket.net;
  EXPECT_TRUE(pocket.open_ends.empty());
  EXPECT_NEAR(static_cast<double>(net.nodes.size()), 100, 3);
  for (std::size_t i = 0; i < net.nodes.size(); ++i) {
    const Vector2d xy = net.nodes[i].head<2>();
    const bool within = inside(shape.outline, xy);
    EXPECT_EQ(net.inside[i] != 0, within);
    EXPECT_EQ(net.kinds[i], within ? NodeKind::inner : NodeKind::fixed);
    if (within) {
      EXPECT_FALSE(misses_a_neighbour(net, i));
    } else {
      EXPECT_LE(distance_to_outline(shape.outline, xy), net.spacing);
    }
  }
}

TEST(FibreNet, CoversEveryPlaceWithinTheOffsetOutlineOnAPlane) {
  // On the plane the net is the grid: the nodes are exactly the grid points inside the offset outline.
  const exact::Plane mold;
  const Polygon outline = rectangle(-20.2, -9.7, 31.1, 14.3);
  const double d = 3.0;
  const Net net = fibre_net(mold, mold, shape_of(outline), with_spacing(d)).net;
  std::set<std::pair<int, int>> expected, found;
  for (int i = -20; i <= 20; ++i)
    for (int j = -20; j <= 20; ++j) {
      const Vector2d p(d * i, d * j);
      if (inside(outline, p) || distance_to_outline(outline, p) <= d) expected.insert({i, j});
    }
  for (const auto& [i, j] : net.lattice) found.insert({i, j});
  EXPECT_EQ(found, expected);
}

TEST(FibreNet, CountIsNearTheTargetForManyOutlines) {
  const exact::Hills ply(2, 0.05, {0.1, 0.05});
  const std::vector<std::pair<std::string, Polygon>> outlines{{"round", ellipse(60, 60)},
                                                              {"round, turned fibres", ellipse(60, 60)},
                                                              {"tiny", ellipse(1.1, 0.9)},
                                                              {"paper's largest", ellipse(140, 100)},
                                                              {"paper's smallest", ellipse(13, 13)},
                                                              {"long", ellipse(100, 12, 0.4)},
                                                              {"long, narrow", ellipse(150, 5, 1.1)},
                                                              {"needle", ellipse(120, 1.5, 0.77)},
                                                              {"rectangle", rectangle(-40, -15, 35, 22)},
                                                              {"lobes", wavy(50, 0.35, 3)},
                                                              {"star", wavy(40, 0.6, 5)},
                                                              {"square", rectangle(-10, -10, 10, 10)}};
  for (const auto& [name, outline] : outlines)
    for (const FibreAngles angles : {FibreAngles{0, kPi / 2}, FibreAngles{kPi / 4, -kPi / 4}, FibreAngles{0.3, 1.2}})
      for (const int target : {60, 100, 300}) {
        FibreNetOptions options;
        options.node_target = target;
        const PocketNet pocket = fibre_net(ply, ply, shape_of(outline, angles), options);
        expect_sound(pocket, ply);
        const int count = static_cast<int>(pocket.net.nodes.size());
        if (std::abs(count - target) > 0.03 * target) std::printf("%s, %d wanted: %d nodes\n", name.c_str(), target, count);
        EXPECT_NEAR(count, target, 0.06 * target + 2) << name << ", spacing " << pocket.net.spacing;
      }
}

TEST(FibreNet, NodesNearThePlysEdgeAreFreeAndNonePassIt) {
  const exact::Bell bell(8, 40);
  const exact::Plane mold;
  PocketShape shape = shape_of(ellipse(40, 40), {0.2, 1.7});
  shape.ply_outline = rectangle(-200, -200, 25, 200);  // the edge cuts the pocket at x = 25
  const PocketNet pocket = fibre_net(bell, mold, shape);
  expect_sound(pocket, bell);
  EXPECT_TRUE(pocket.open_ends.empty());
  EXPECT_NEAR(static_cast<double>(pocket.net.nodes.size()), 100, 3);
  int ends = 0, held = 0, slipping = 0;
  for (std::size_t i = 0; i < pocket.net.nodes.size(); ++i) {
    const Vector3d& p = pocket.net.nodes[i];
    const bool within = inside(shape.outline, p.head<2>());
    EXPECT_LT(p.x(), 25);
    if (within) {
      EXPECT_EQ(pocket.net.kinds[i], misses_a_neighbour(pocket.net, i) ? NodeKind::free : NodeKind::inner);
      ends += misses_a_neighbour(pocket.net, i);
    } else {
      EXPECT_EQ(pocket.net.kinds[i], p.x() >= 5 ? NodeKind::free : NodeKind::fixed) << p.transpose();
      (p.x() >= 5 ? slipping : held) += 1;
    }
  }
  EXPECT_GT(ends, 3);
  EXPECT_GT(held, 10);
  EXPECT_GT(slipping, 3);

  FibreNetOptions narrow;
  narrow.edge_tol = 0;
  const PocketNet sharp = fibre_net(bell, mold, shape, narrow);
  for (std::size_t i = 0; i < sharp.net.nodes.size(); ++i)
    if (!inside(shape.outline, sharp.net.nodes[i].head<2>())) {
      EXPECT_EQ(sharp.net.kinds[i], NodeKind::fixed);
    }

  shape.ply_outline.clear();
  for (const NodeKind kind : fibre_net(bell, mold, shape).net.kinds) EXPECT_NE(kind, NodeKind::free);
}

TEST(FibreNet, BandNodesAboveTheMoldStayMovableAndAreOpenEnds) {
  // The outline cuts the bell half-way up: nothing in the band rests on the mold on one side.
  const exact::Bell bell(12, 50);
  const exact::Plane mold;
  const PocketNet pocket = fibre_net(bell, mold, shape_of(ellipse(25, 25)), with_spacing(6));
  expect_sound(pocket, bell);
  EXPECT_FALSE(pocket.open_ends.empty());
  for (std::size_t i = 0; i < pocket.net.nodes.size(); ++i) {
    EXPECT_EQ(pocket.net.kinds[i], NodeKind::inner);
    int count = 0;
    for (const int j : pocket.net.neighbours[i]) count += j >= 0;
    EXPECT_GE(count, 2);
    const bool open = std::count(pocket.open_ends.begin(), pocket.open_ends.end(), static_cast<int>(i)) > 0;
    EXPECT_EQ(open, count < 4);
  }
  // With the same tolerance as the band's height all of them are held.
  FibreNetOptions loose = with_spacing(6);
  loose.mold_tol = 12;
  EXPECT_TRUE(fibre_net(bell, mold, shape_of(ellipse(25, 25)), loose).open_ends.empty());
}

// A flat part that ends 3 mm beyond the line x + y = -20; NaN farther on.
struct Cliff : Surface {
  SurfaceSample sample(const Vector2d& p) const override {
    SurfaceSample s;
    if ((p.x() + p.y() + 20) / std::sqrt(2.0) < -3) s.height = std::numeric_limits<double>::quiet_NaN();
    return s;
  }
};

TEST(FibreNet, ReachesAFootAlongAnEdgeWhereTheMoldEndsOnTheSurfaceThatGoesOn) {
  const Cliff cliff;
  const Polygon ply{{180, -200}, {300, -200}, {300, 300}, {-320, 300}};  // one of its edges is the line
  const Vector2d along = Vector2d(-1, 1).normalized(), inwards = Vector2d(1, 1).normalized();
  PocketShape shape;
  shape.angles = {0, kPi / 2};
  shape.ply_outline = ply;
  for (const auto& [s, d] : {std::pair{-20.0, -12.0}, {150.0, -12.0}, {150.0, 30.0}, {-20.0, 30.0}})
    shape.outline.push_back(s * along + d * inwards);
  FibreNetOptions options = with_spacing(8);
  options.edge_tol = 10;
  const exact::Bell above(8, 500);  // off the mold all over the foot's arm, so that an end there is open
  struct Sum : Surface {
    const Surface &a, &b;
    Sum(const Surface& one, const Surface& other) : a(one), b(other) {}
    SurfaceSample sample(const Vector2d& p) const override {
      SurfaceSample s = a.sample(p);
      const SurfaceSample more = b.sample(p);
      s.height += more.height, s.gradient += more.gradient, s.hessian += more.hessian;
      return s;
    }
  };
  const Sum standing(cliff, above);
  const auto farthest = [&](const Surface& surface) {
    double reach = 0;
    for (const Vector3d& node : fibre_net(surface, cliff, shape, options).net.nodes) reach = std::max(reach, node.head<2>().dot(along));
    return reach;
  };
  EXPECT_LT(farthest(standing), 100);
  EXPECT_GT(farthest(BeyondEdge(standing, OutlineSearch(ply))), 145);
}

TEST(BeyondEdge, IsTheSurfaceOnThePlyAndItsTangentPlaneBeside) {
  const exact::Hills hills(3, 0.02, {0.1, 0.2});
  const Polygon ply = rectangle(-50, -40, 50, 40);
  const OutlineSearch ply_edge(ply);
  const BeyondEdge extended(hills, ply_edge);
  for (const Vector2d& on : {Vector2d(0, 0), Vector2d(49, -39)}) EXPECT_EQ(extended.height(on), hills.height(on));
  const SurfaceSample edge = hills.sample({50, 10}), corner = hills.sample({-50, 40}), beside = extended.sample({62, 10});
  EXPECT_NEAR(beside.height, edge.height + 12 * edge.gradient.x(), 1e-12);
  EXPECT_EQ(beside.gradient, edge.gradient);
  EXPECT_TRUE(beside.hessian.isZero());
  EXPECT_NEAR(extended.height({-53, 44}), corner.height + corner.gradient.dot(Vector2d(-3, 4)), 1e-12);
  EXPECT_NEAR(extended.height({50 + 1e-7, 10}), extended.height({50 - 1e-7, 10}), 1e-6);
}

TEST(FibreNet, InsideIsToldByTheRmsOutlineWhereThereIsOne) {
  const exact::Bell bell(12, 50);
  const exact::Plane mold;
  PocketShape shape = shape_of(ellipse(50, 50));
  shape.rms_outline = ellipse(30, 30);
  const Net net = fibre_net(bell, mold, shape).net;
  int some = 0;
  for (std::size_t i = 0; i < net.nodes.size(); ++i) {
    EXPECT_EQ(net.inside[i] != 0, net.nodes[i].head<2>().norm() < 30);
    some += net.inside[i];
  }
  EXPECT_GT(some, 10);
}

TEST(FibreNet, IsTheSameForEitherSenseOfTheOutlineAndTurnsWithThePocket) {
  const exact::Bell bell(10, 45, 1.5);
  const exact::Plane mold;
  const PocketShape shape = shape_of(ellipse(68, 45), {0.25, 1.9});
  const PocketNet one = fibre_net(bell, mold, shape);
  PocketShape back = shape;
  std::reverse(back.outline.begin(), back.outline.end());
  const PocketNet other = fibre_net(bell, mold, back);
  ASSERT_EQ(one.net.nodes.size(), other.net.nodes.size());
  for (std::size_t i = 0; i < one.net.nodes.size(); ++i) EXPECT_LT((one.net.nodes[i] - other.net.nodes[i]).norm(), 1e-9);
  EXPECT_EQ(one.net.neighbours, other.net.neighbours);

  const double turn = 0.9;
  const exact::Turned turned(bell, turn);
  PocketShape turned_shape = shape_of(ellipse(68, 45, turn), {0.25 + turn, 1.9 + turn});
  const PocketNet again = fibre_net(turned, mold, turned_shape, with_spacing(one.net.spacing));
  ASSERT_EQ(one.net.nodes.size(), again.net.nodes.size());
  EXPECT_EQ(one.net.lattice, again.net.lattice);
  for (std::size_t i = 0; i < one.net.nodes.size(); ++i)
    EXPECT_LT((turned.turn * one.net.nodes[i].head<2>() - again.net.nodes[i].head<2>()).norm(), 1e-8);
}

TEST(FibreNet, TheSpacingFollowsTheOutlineNotItsNoise) {
  const exact::Plane mold;
  double least = 1e9, most = 0;
  for (int k = 0; k < 20; ++k) {
    const PocketNet pocket = fibre_net(mold, mold, shape_of(ellipse(50 + 0.01 * k, 35 + 0.007 * k), {0.2, 1.7}));
    least = std::min(least, pocket.net.spacing);
    most = std::max(most, pocket.net.spacing);
  }
  EXPECT_LT(most / least, 1.03);
}

TEST(FibreNet, IsSmallButSoundWhenTheSpacingIsLarge) {
  const exact::Plane mold;
  const PocketNet pocket = fibre_net(mold, mold, shape_of(ellipse(3, 3)), with_spacing(20));
  expect_sound(pocket, mold);
  EXPECT_EQ(pocket.net.nodes.size(), 5u);
  EXPECT_TRUE(pocket.open_ends.empty());
}

TEST(SurfaceArea, IsExactOnPlanesAndConvergesOnASphere) {
  const exact::Plane plane(0, {0.75, 1.0});
  const Polygon shape = wavy(30, 0.5, 4);
  EXPECT_NEAR(surface_area(plane, shape), polygon_area(shape) * std::sqrt(1 + 0.5625 + 1), 1e-8);
  // A cap of height h of a sphere has the area 2 pi R h.
  const exact::Sphere sphere(100);
  const double cap = 2 * kPi * 100 * (100 - std::sqrt(1e4 - 60 * 60));
  EXPECT_NEAR(surface_area(sphere, ellipse(60, 60, 0, {0, 0}, 2000)) / cap, 1, 5e-5);
  Polygon clockwise = ellipse(60, 60, 0, {0, 0}, 2000);
  std::reverse(clockwise.begin(), clockwise.end());
  EXPECT_NEAR(surface_area(sphere, clockwise) / cap, 1, 5e-5);
  EXPECT_NEAR(surface_area(plane, rectangle(0, 0, 10, 6), rectangle(-5, -5, 5, 50)) / (30 * std::sqrt(2.5625)), 1, 2e-2);
}

TEST(FibreNet, NamesBadInput) {
  const exact::Plane mold;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const PocketShape good = shape_of(ellipse(20, 20));
  const auto net = [&](const PocketShape& shape, const FibreNetOptions& options = {}) {
    return message([&] { fibre_net(mold, mold, shape, options); });
  };
  const auto expect = [](const std::string& text, const std::string& start) { EXPECT_EQ(text.substr(0, start.size()), start) << text; };
  EXPECT_EQ(net(good), "no error");
  PocketShape shape = good;
  shape.centre = {nan, 0};
  expect(net(shape), "centre_mm: ");
  shape.centre = {21, 0};
  expect(net(shape), "centre_mm: expected a point inside outline_mm, but got (21, 0)");
  shape = good;
  shape.ply_outline = rectangle(5, -50, 50, 50);
  expect(net(shape), "centre_mm: expected a point inside ply_outline");
  shape = good;
  shape.angles = {0.5, 0.5 + kPi + 0.1};
  expect(net(shape), "angles_deg: ");
  shape.angles = {nan, 1};
  expect(net(shape), "angles_deg: ");
  for (const Polygon& bad : {Polygon{}, Polygon{{0, 0}, {1, 1}}, Polygon{{0, 0}, {1, 1}, {2, 2}}, Polygon{{-9, -9}, {9, nan}, {0, 9}}}) {
    shape = good;
    shape.outline = bad;
    expect(net(shape), "outline_mm: ");
    if (bad.empty()) continue;
    shape = good;
    shape.ply_outline = bad;
    expect(net(shape), "ply_outline: ");
    shape = good;
    shape.rms_outline = bad;
    expect(net(shape), "rms_outline_mm: ");
  }
  for (const double spacing : {0.0, -2.0, nan}) expect(net(good, with_spacing(spacing)), "spacing_mm: ");
  FibreNetOptions options;
  options.node_target = 8;
  expect(net(good, options), "node_target: ");
  options = {};
  options.edge_tol = -1;
  expect(net(good, options), "edge_tol_mm: ");
  options = {};
  options.mold_tol = nan;
  expect(net(good, options), "mold_tol_mm: ");
}

}  // namespace
}  // namespace debulk::fibre_net_test
