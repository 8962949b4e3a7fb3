#include "debulk/net/lay.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

#include "debulk/net/cell.hpp"
#include "message.hpp"
#include "surfaces.hpp"
#include "whole_net.hpp"

namespace debulk::lay_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const double kPi = std::acos(-1.0);
const double kDegree = kPi / 180;

NetDomain disc(double radius) {
  return [radius](const Vector2d& p) { return p.norm() <= radius; };
}

Net whole(const Lattice& lattice) {
  return number_nodes(lattice, std::vector<std::uint8_t>(lattice.nodes.size(), 1));
}

void expect_net_on(const Surface& surface, const Net& net, double length_tolerance = 1e-9) {
  for (const auto& [a, b] : segments(net.neighbours)) EXPECT_NEAR((net.nodes[a] - net.nodes[b]).norm() / net.spacing, 1, length_tolerance);
  for (const Vector3d& p : net.nodes) EXPECT_NEAR(p.z(), surface.height(p.head<2>()), 1e-12 * (1 + std::abs(p.z())));
  for (std::size_t i = 0; i < net.nodes.size(); ++i)
    for (const auto& [there, back] : {std::pair{east, west}, std::pair{west, east}, std::pair{north, south}, std::pair{south, north}}) {
      const int j = net.neighbours[i][there];
      if (j >= 0) {
        EXPECT_EQ(net.neighbours[j][back], static_cast<int>(i));
      }
    }
}

TEST(LayNet, IsTheExactGridOnATiltedPlane) {
  const exact::Plane plane(3.0, {0.4, -0.7});
  for (const PathRule rule : {PathRule::geodesic, PathRule::vertical_plane, PathRule::least_shear})
    for (const FibreAngles angles : {FibreAngles{0, kPi / 2}, FibreAngles{0.7, 2.9}, FibreAngles{0.2, -0.9}}) {
      LayOptions options;
      options.paths = rule;
      const Lattice lattice = lay_net(plane, {5, 2}, angles, 1.5, disc(30), options);
      const Vector3d u = fibre_direction(plane, {5, 2}, angles[0]), v = fibre_direction(plane, {5, 2}, angles[1]);
      EXPECT_NEAR(std::atan2(u.y(), u.x()), angles[0], 1e-14);
      int laid = 0;
      for (int j = lattice.south; j <= lattice.north; ++j)
        for (int i = lattice.west; i <= lattice.east; ++i) {
          if (!lattice.has(i, j)) continue;
          ++laid;
          const Vector3d expected = Vector3d(5, 2, plane.height({5, 2})) + 1.5 * (i * u + j * v);
          EXPECT_LT((lattice.at(i, j) - expected).norm(), 1e-10) << i << " " << j;
        }
      EXPECT_GT(laid, 500);
    }
}

TEST(LayNet, PathsLeaveInTheAskedDirectionsAndAreGreatCirclesOnASphere) {
  const exact::Sphere sphere(50);
  const Vector2d start(12, -7);
  const double spacing = 2.5;
  for (const double angle : {0.0, 1.1, 2.6, -2.0}) {
    const Vector3d p0(start.x(), start.y(), sphere.height(start));
    const Vector3d t = fibre_direction(sphere, start, angle);
    EXPECT_NEAR(t.dot(p0), 0, 1e-12);
    EXPECT_NEAR(std::remainder(std::atan2(t.y(), t.x()) - angle, 2 * kPi), 0, 1e-13);
    const auto path = fibre_path(sphere, start, angle, spacing, PathRule::geodesic, disc(45), 1000);
    EXPECT_GE(path.size(), 9u);
    const double arc = 2 * std::asin(spacing / 100);  // of one chord
    for (std::size_t k = 0; k < path.size(); ++k) {
      const double a = arc * static_cast<double>(k + 1);
      EXPECT_LT((path[k] - (std::cos(a) * p0 + std::sin(a) * 50 * t)).norm(), 1e-7) << k;
    }
  }
}

// A peak so steep that a fibre laid past it runs round it and back: a cone of slope 2 with a rounded tip.
struct Peak : Surface {
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    const double r = std::sqrt(p.squaredNorm() + 25);
    return {-2 * r, -2 * p / r, -2 / r * Eigen::Matrix2d::Identity() + 2 * p * p.transpose() / (r * r * r)};
  }
};

TEST(LayNet, PathsEndWhereTheyTurnBack) {
  const auto path = fibre_path(Peak(), {-60, 8}, 0.0, 3.0, PathRule::geodesic, disc(200), 1000);
  ASSERT_GE(path.size(), 10U);
  EXPECT_LT(path.size(), 100U);
  for (std::size_t k = 1; k < path.size(); ++k) EXPECT_GT(path[k].x(), path[k - 1].x());
}

TEST(LayNet, VerticalPlanePathsAreStraightSeenFromAbove) {
  const exact::Hills hills(4, 0.12, {0.1, 0.05});
  const auto path = fibre_path(hills, {1, 2}, 0.6, 3.0, PathRule::vertical_plane, disc(60), 1000);
  ASSERT_GT(path.size(), 15u);
  Vector3d last(1, 2, hills.height({1, 2}));
  for (const Vector3d& p : path) {
    EXPECT_NEAR(std::cos(0.6) * (p.y() - 2) - std::sin(0.6) * (p.x() - 1), 0, 1e-11);
    EXPECT_NEAR((p - last).norm(), 3.0, 1e-11);
    last = p;
  }
}

TEST(LayNet, GeodesicsConvergeWithTheSpacingsFractionOnHills) {
  // The same curve whatever the node spacing: a fine path passes through the coarse path's nodes up to its chords' shortfall.
  const exact::Hills hills(4, 0.12, {0.1, 0.05});
  const auto coarse = fibre_path(hills, {1, 2}, 0.6, 4.0, PathRule::geodesic, disc(60), 1000);
  const auto fine = fibre_path(hills, {1, 2}, 0.6, 0.01, PathRule::geodesic, disc(60), 100000);
  for (const Vector3d& p : coarse) {
    double nearest = 1e9;
    for (std::size_t k = 0; k + 1 < fine.size(); ++k) {
      const Vector3d side = fine[k + 1] - fine[k];
      const double t = std::min(1.0, std::max(0.0, (p - fine[k]).dot(side) / side.squaredNorm()));
      nearest = std::min(nearest, (p - fine[k] - t * side).norm());
    }
    EXPECT_LT(nearest, 1e-5);
  }
}

TEST(LayNet, FourthNodeOnASphereIsTheMirrorImage) {
  const double radius = 80;
  const exact::Sphere sphere(radius);
  const Lattice lattice = lay_net(sphere, {10, 5}, {0.3, 1.6}, 6.0, disc(60));
  int cells = 0;
  for (int j = lattice.south; j < lattice.north; ++j)
    for (int i = lattice.west; i < lattice.east; ++i) {
      if (!lattice.has(i, j) || !lattice.has(i + 1, j) || !lattice.has(i, j + 1) || !lattice.has(i + 1, j + 1)) continue;
      const Vector3d &c = lattice.at(i, j), &a = lattice.at(i + 1, j), &b = lattice.at(i, j + 1);
      const Vector3d normal = a.cross(b).normalized();  // of the plane (a, b, O)
      EXPECT_LT((c - 2 * c.dot(normal) * normal - lattice.at(i + 1, j + 1)).norm(), 1e-9);
      ++cells;
    }
  EXPECT_GT(cells, 100);
}

// s w'' + w' = -sin w, w(0) = pi/2, with s = u v / R^2 (docs/model.md, section 2); returns the shear pi/2 - w at s.
double sphere_shear(double s_end) {
  double w = kPi / 2, dw = -1, s = 0;
  const int steps = 20000;
  const double h = s_end / steps;
  const auto second = [](double t, double y, double dy) { return t < 1e-12 ? 0.0 : (-std::sin(y) - dy) / t; };
  for (int k = 0; k < steps; ++k, s += h) {
    const double k1 = dw, l1 = second(s, w, dw);
    const double k2 = dw + h / 2 * l1, l2 = second(s + h / 2, w + h / 2 * k1, k2);
    const double k3 = dw + h / 2 * l2, l3 = second(s + h / 2, w + h / 2 * k2, k3);
    const double k4 = dw + h * l3, l4 = second(s + h, w + h * k3, k4);
    w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    dw += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
  }
  return kPi / 2 - w;
}

// Shear at the node (n, n) of a net whose paths are great circles with n chords to the arc u = v = arc: the mean over the
// node's four cells.
double net_shear(double radius, double arc, int n) {
  const exact::Sphere sphere(radius);
  const double spacing = 2 * radius * std::sin(arc / radius / n / 2);
  const auto everywhere = [&](const Vector2d& p) { return p.norm() < radius * 0.9999; };
  const Lattice lattice = lay_net(sphere, {0, 0}, {0, kPi / 2}, spacing, everywhere);
  EXPECT_TRUE(lattice.has(n + 1, n + 1));
  const Vector3d& p = lattice.at(n, n);
  double sum = 0;
  for (const int si : {1, -1})
    for (const int sj : {1, -1}) {
      const Vector3d u = si * (lattice.at(n + si, n) - p), v = sj * (lattice.at(n, n + sj) - p);
      sum += kPi / 2 - std::atan2(u.cross(v).norm(), u.dot(v));
    }
  return sum / 4;
}

TEST(LayNet, FibreAnglesOnASphereConvergeAtSecondOrder) {
  EXPECT_NEAR(sphere_shear(0.25) / kDegree, 14.274, 1e-3);
  EXPECT_NEAR(sphere_shear(0.5) / kDegree, 28.257, 1e-3);
  EXPECT_NEAR(sphere_shear(1.0) / kDegree, 54.318, 1e-3);

  const double exact_shear = sphere_shear(0.64);
  double previous = 0;
  for (const int n : {8, 16, 32, 64}) {
    const double error = std::abs(net_shear(100, 80, n) - exact_shear) / kDegree;
    std::printf("sphere, u = v = 0.8 R, %2d steps: shear error %.2e degrees\n", n, error);
    if (previous > 0) {
      EXPECT_NEAR(previous / error, 4, 0.3) << n;
    }
    previous = error;
  }
  EXPECT_LT(previous, 1e-3 * 2);
  for (const double s : {0.25, 0.5}) EXPECT_NEAR(net_shear(100, 100 * std::sqrt(s), 64), sphere_shear(s), 2e-3 * kDegree);
}

TEST(LayNet, IsAProductOfScrewsOnACylinder) {
  const double radius = 40, spacing = 3.0;
  const exact::Cylinder cylinder(radius);
  const FibreAngles angles{0.35, 1.75};
  const auto region = [](const Vector2d& p) { return std::abs(p.x()) < 35 && std::abs(p.y()) < 33; };
  const Vector2d start(2, 0);
  const Lattice lattice = lay_net(cylinder, start, angles, spacing, region);
  // A screw per fibre: x advances by s cos(angle), the turn about the axis by s sin(angle) / R, with the arc s for which the
  // helix's chord is the spacing.
  std::array<Vector2d, 2> screw;  // (advance, turn)
  for (int f : {0, 1}) {
    double s = spacing;
    for (int k = 0; k < 60; ++k) {
      const double advance = s * std::cos(angles[f]), turn = s * std::sin(angles[f]) / radius;
      s *= spacing / std::hypot(advance, 2 * radius * std::sin(turn / 2));
    }
    screw[f] = {s * std::cos(angles[f]), s * std::sin(angles[f]) / radius};
  }
  int laid = 0;
  for (int j = lattice.south; j <= lattice.north; ++j)
    for (int i = lattice.west; i <= lattice.east; ++i) {
      if (!lattice.has(i, j)) continue;
      const Vector2d total = i * screw[0] + j * screw[1];
      const Vector3d expected(start.x() + total.x(), radius * std::sin(total.y()), radius * std::cos(total.y()));
      EXPECT_LT((lattice.at(i, j) - expected).norm(), 1e-8) << i << " " << j;
      ++laid;
    }
  EXPECT_GT(laid, 300);
}

TEST(LayNet, EverySegmentHasTheSpacingOnBumps) {
  const exact::Hills hills(5, 0.15, {0.2, -0.1});
  const exact::Bell bell(15, 40);
  for (const double spacing : {0.7, 2.4, 6.0})
    for (const FibreAngles angles : {FibreAngles{0, kPi / 2}, FibreAngles{0.4, 1.3}, FibreAngles{1.0, -1.2}}) {
      expect_net_on(hills, whole(lay_net(hills, {3, 1}, angles, spacing, disc(50))));
      const Net net = whole(lay_net(bell, {3, 1}, angles, spacing, disc(50)));
      expect_net_on(bell, net);
      EXPECT_GT(net.nodes.size() * spacing * spacing * std::abs(std::sin(angles[1] - angles[0])), 0.6 * kPi * 2500);
    }
}

TEST(LayNet, TurnsWithTheSurfaceAndTheAngles) {
  const exact::Hills hills(5, 0.12, {0.2, -0.1});
  const double turn = 0.83;
  const exact::Turned turned(hills, turn);
  const Vector2d centre(4, -3);
  const Lattice before = lay_net(hills, centre, {0.1, 1.5}, 2.5, disc(40));
  const Lattice after = lay_net(turned, turned.turn * centre, {0.1 + turn, 1.5 + turn}, 2.5, disc(40));
  ASSERT_EQ(before.nodes.size(), after.nodes.size());
  for (std::size_t k = 0; k < before.nodes.size(); ++k) {
    ASSERT_EQ(before.nodes[k].allFinite(), after.nodes[k].allFinite());
    if (!before.nodes[k].allFinite()) continue;
    EXPECT_LT((turned.turn * before.nodes[k].head<2>() - after.nodes[k].head<2>()).norm(), 1e-8);
  }
}

TEST(NetLayer, LaysTheSameNodesInWhateverOrderTheyAreAskedFor) {
  const exact::Hills hills(5, 0.12, {0.2, -0.1});
  const FibreAngles angles{0.1, 1.5};
  const NetDomain region = disc(30);
  const Lattice all = lay_net(hills, {4, -3}, angles, 2.5, region);
  FibreRays rays = fibre_rays(hills, {4, -3}, angles, 2.5 / kStepsPerSegment, PathRule::geodesic);
  NetLayer few(hills, rays, angles, 2.5, region, {});
  const auto expect_node = [&](int i, int j) {
    const Vector3d* node = few.at(i, j);
    ASSERT_EQ(node != nullptr, all.has(i, j)) << i << " " << j;
    if (node != nullptr) {
      EXPECT_EQ(*node, all.at(i, j));
    }
  };
  for (const auto& [i, j] : {std::pair{-5, 6}, {7, 3}, {7, -3}, {0, 0}, {-2, 0}, {1, 1}}) expect_node(i, j);
  const Lattice some = few.lattice();
  EXPECT_EQ((std::array<int, 4>{some.west, some.east, some.south, some.north}), (std::array<int, 4>{-5, 7, -3, 6}));
  EXPECT_FALSE(some.has(-5, -3));
  expect_node(40, 1);  // beyond the region
  for (int j = all.north + 1; j >= all.south - 1; --j)
    for (int i = all.west - 1; i <= all.east + 1; ++i) expect_node(i, j);
  EXPECT_EQ(few.lattice().nodes.size(), all.nodes.size());
}

TEST(NetLayer, NetsOfOtherSpacingsShareTheRays) {
  const exact::Sphere sphere(100);
  const FibreAngles angles{0.3, 1.6};
  FibreRays rays = fibre_rays(sphere, {10, 5}, angles, 6.0 / kStepsPerSegment, PathRule::geodesic);
  const NetDomain region = disc(60);
  for (const double spacing : {6.0, 3.0, 4.7}) {
    NetLayer layer(sphere, rays, angles, spacing, region, {});
    const Lattice alone = lay_net(sphere, {10, 5}, angles, spacing, region);
    for (int j = alone.south; j <= alone.north; ++j)
      for (int i = alone.west; i <= alone.east; ++i) {
        const Vector3d* node = layer.at(i, j);
        ASSERT_EQ(node != nullptr, alone.has(i, j));
        if (node != nullptr) {
          EXPECT_LT((*node - alone.at(i, j)).norm(), 1e-8);
        }
      }
    expect_net_on(sphere, whole(layer.lattice()));
  }
}

TEST(LayNet, ExchangingTheFibresExchangesTheLattice) {
  const exact::Hills hills(5, 0.12, {0.2, -0.1});
  const Lattice one = lay_net(hills, {4, -3}, {0.1, 1.5}, 2.5, disc(30));
  const Lattice other = lay_net(hills, {4, -3}, {1.5, 0.1}, 2.5, disc(30));
  ASSERT_EQ(one.nodes.size(), other.nodes.size());
  for (int j = one.south; j <= one.north; ++j)
    for (int i = one.west; i <= one.east; ++i) {
      ASSERT_EQ(one.has(i, j), other.has(j, i));
      if (one.has(i, j)) {
        EXPECT_LT((one.at(i, j) - other.at(j, i)).norm(), 1e-11);
      }
    }
}

TEST(LayNet, StopsAtShearLockingInsteadOfFailing) {
  // On the whole upper half of a sphere the quadrants shear beyond 90 degrees: what exists is still a net.
  const exact::Sphere sphere(100);
  const auto region = [](const Vector2d& p) { return p.norm() < 99.99; };
  const Net net = whole(lay_net(sphere, {0, 0}, {0, 40 * kDegree}, 4.0, region));
  expect_net_on(sphere, net);
  // A cliff that no segment can climb.
  struct Cliff : Surface {
    SurfaceSample sample(const Vector2d& p) const override {
      return {p.x() > 10 ? 5.0 * (p.x() - 10) * (p.x() - 10) : 0.0, {p.x() > 10 ? 10.0 * (p.x() - 10) : 0.0, 0.0}, Eigen::Matrix2d::Zero()};
    }
  } cliff;
  expect_net_on(cliff, whole(lay_net(cliff, {0, 0}, {0.3, 1.8}, 3.0, disc(30))));
}

TEST(LayNet, FourthNodeRefusesLockedCells) {
  const exact::Plane plane;
  EXPECT_FALSE(fourth_node(plane, {0, 0, 0}, {1, 0, 0}, {1, 0, 0}, 1.0));
  EXPECT_FALSE(fourth_node(plane, {0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, 1.0));
  EXPECT_FALSE(fourth_node(plane, {0, 0, 0}, {3, 0, 0}, {0, 3, 0}, 1.0));
  const auto square = fourth_node(plane, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1.0);
  ASSERT_TRUE(square);
  EXPECT_LT((*square - Vector3d(1, 1, 0)).norm(), 1e-14);
}

TEST(LayNet, NumbersRowByRowAlongTheShorterSide) {
  const exact::Plane plane;
  const auto strip = [](const Vector2d& p) { return std::abs(p.x()) < 20.5 && std::abs(p.y()) < 3.5; };
  for (const FibreAngles angles : {FibreAngles{0, kPi / 2}, FibreAngles{kPi / 2, 0}}) {
    const Net net = whole(lay_net(plane, {0, 0}, angles, 1.0, strip));
    EXPECT_EQ(net.nodes.size(), 41u * 7u);
    EXPECT_EQ(bandwidth(net.neighbours), 7);
    for (const double shear : shear_angles(net)) EXPECT_NEAR(shear, 0, 1e-9);
  }
  const Net skewed = whole(lay_net(plane, {0, 0}, {0, 65 * kDegree}, 1.0, strip));
  for (const double shear : shear_angles(skewed)) EXPECT_NEAR(shear, 25 * kDegree, 1e-9);
}

TEST(LayNet, NamesBadInput) {
  const exact::Plane plane;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto lay = [&](const Vector2d& centre, const FibreAngles& angles, double spacing) {
    return message([&] { lay_net(plane, centre, angles, spacing, disc(10)); });
  };
  EXPECT_NE(lay({nan, 0}, {0, 1}, 1).find("centre_mm"), std::string::npos);
  EXPECT_NE(lay({0, 0}, {nan, 1}, 1).find("angles_deg"), std::string::npos);
  EXPECT_NE(lay({0, 0}, {0, 9 * kDegree}, 1).find("cross at 10 degrees or more, but got 9 degrees"), std::string::npos);
  EXPECT_NE(lay({0, 0}, {0.2, 0.2 + kPi}, 1).find("angles_deg"), std::string::npos);
  for (const double spacing : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()})
    EXPECT_NE(lay({0, 0}, {0, 1}, spacing).find("spacing_mm"), std::string::npos);
  EXPECT_NE(lay({0, 0}, {0, 1}, 1e-3).find("spacing_mm: expected a spacing that needs fewer nodes"), std::string::npos);
  EXPECT_NE(message([&] { lay_net(exact::Sphere(5), {7, 0}, {0, 1}, 1, disc(10)); }).find("centre_mm"), std::string::npos);
  EXPECT_EQ(lay({0, 0}, {0, 11 * kDegree}, 1), "no error");
}

}  // namespace
}  // namespace debulk::lay_test
