#include "debulk/net/drape.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "debulk/core/error.hpp"
#include "surfaces.hpp"

namespace debulk::drape_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const double kPi = std::acos(-1.0);

std::vector<Vector2d> rectangle(double x, double y) {
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

TEST(Drape, KeepsItsAnglesOnAPlaneUpToThePlysCorners) {
  const exact::Plane plane(1, {0.3, 0.2});
  for (const FibreAngles angles : {FibreAngles{0, kPi / 2}, FibreAngles{kPi / 4, -kPi / 4}, FibreAngles{0.4, 1.2}}) {
    const Drape drape(plane, {12, -7}, angles, 5.0, rectangle(60, 45));
    for (double x = -60; x <= 60; x += 3.7)
      for (double y = -45; y <= 45; y += 3.1) {
        const auto found = drape.fibre_angles({x, y});
        ASSERT_TRUE(found) << x << " " << y;
        EXPECT_NEAR((*found)[0], angles[0], 1e-9);
        EXPECT_NEAR((*found)[1], angles[1], 1e-9);
      }
    EXPECT_TRUE(drape.fibre_angles({60, 45}));
    EXPECT_FALSE(drape.fibre_angles({200, 0}));
    EXPECT_FALSE(drape.fibre_angles({std::nan(""), 0}));
  }
}

TEST(Drape, FollowsTheScrewsOnACylinder) {
  // Unrolled, a geodesic net on a cylinder is a straight grid: a fibre keeps its angle to the axis.
  const exact::Cylinder cylinder(100);
  const FibreAngles angles{0.5, 1.9};
  const Drape drape(cylinder, {0, 0}, angles, 1.0, rectangle(50, 60));
  for (double x = -50; x <= 50; x += 9)
    for (double y = -60; y <= 60; y += 7) {
      const auto found = drape.fibre_angles({x, y});
      ASSERT_TRUE(found);
      const double foreshortening = std::sqrt(1 - y * y / 1e4);  // of the hoop direction seen from above
      for (int f : {0, 1}) EXPECT_NEAR((*found)[f], std::atan2(std::sin(angles[f]) * foreshortening, std::cos(angles[f])), 5e-3);
    }
}

TEST(Drape, NetIsSoundAndKnowsThePly) {
  const exact::Hills hills(10, 0.03, {0.05, 0.02});
  const Drape drape(hills, {3, 4}, {0.1, 1.7}, 8.0, rectangle(150, 100));
  const Net& net = drape.net();
  int within = 0;
  for (std::size_t i = 0; i < net.nodes.size(); ++i) within += net.inside[i];
  EXPECT_NEAR(within * 64.0 * std::sin(1.6), 4 * 150 * 100 * 1.02, 2500);
  for (const auto& [a, b] : segments(net.neighbours)) EXPECT_NEAR((net.nodes[a] - net.nodes[b]).norm(), 8.0, 8e-9);
}

// Counts the heights that are asked of it.
struct Counting : exact::Hills {
  using Hills::Hills;
  mutable long heights = 0;
  double height(const Vector2d& p) const override { return ++heights, sample(p).height; }
};

TEST(Drape, LaysLittleBesideThePly) {
  // The parallelogram along the fibres about a rectangle at 45 degrees to them is four times as large.
  const auto per_node = [](const FibreAngles& angles) {
    const Counting hills(10, 0.03, {0.05, 0.02});
    const Drape drape(hills, {3, 4}, angles, 4.0, rectangle(150, 100));
    return static_cast<double>(hills.heights) / static_cast<double>(drape.net().nodes.size());
  };
  EXPECT_LT(per_node({kPi / 4, 3 * kPi / 4}), 1.3 * per_node({0, kPi / 2}));
}

TEST(Drape, ReachesAPlyBesideItsSeed) {
  // A ply like a U, laid from a point between its arms.
  const std::vector<Vector2d> u{{-60, -60}, {60, -60}, {60, 60}, {40, 60}, {40, -40}, {-40, -40}, {-40, 60}, {-60, 60}};
  const Drape drape(exact::Plane(), {0, 40}, {0, kPi / 2}, 5.0, u);
  EXPECT_TRUE(drape.fibre_angles({-50, 55}) && drape.fibre_angles({50, 55}) && drape.fibre_angles({0, -50}));
  EXPECT_FALSE(drape.fibre_angles({0, 40}));
}

TEST(Drape, NamesBadInput) {
  const exact::Plane plane;
  EXPECT_THROW(Drape(plane, {70, 0}, {0, 1}, 5, rectangle(60, 45)), InputError);
  EXPECT_THROW(Drape(plane, {std::nan(""), 0}, {0, 1}, 5, rectangle(60, 45)), InputError);
  EXPECT_THROW(Drape(plane, {0, 0}, {0, 0}, 5, rectangle(60, 45)), InputError);
  EXPECT_THROW(Drape(plane, {0, 0}, {0, 1}, 0, rectangle(60, 45)), InputError);
  EXPECT_THROW(Drape(plane, {0, 0}, {0, 1}, 5, {{0, 0}, {1, 1}}), InputError);
}

}  // namespace
}  // namespace debulk::drape_test
