#include "debulk/net/generator_cells.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "debulk/net/drape.hpp"
#include "message.hpp"
#include "surfaces.hpp"
#include "whole_net.hpp"

namespace debulk::generator_cells_test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const double kPi = std::acos(-1.0);

LayOptions least_shear() {
  LayOptions options;
  options.paths = PathRule::least_shear;
  return options;
}

// The first fibre's direction seen from above that is at a right angle to the second fibre's in the tangent plane.
double across(const Surface& surface, const Vector2d& xy, double second) {
  const Vector2d slope = surface.sample(xy).gradient;
  const Vector3d u = fibre_direction(surface, xy, second).cross(Vector3d(-slope.x(), -slope.y(), 1));
  return std::atan2(u.y(), u.x());
}

// The mean of a cell's four shear angles, with their signs, from the crossing angle of an unsheared cell; rad.
double cell_shear(const Lattice& net, int i, int j, double crossing = kPi / 2) {
  const std::array<Vector3d, 4> p{net.at(i, j), net.at(i + 1, j), net.at(i + 1, j + 1), net.at(i, j + 1)};
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    const Vector3d u = p[(k + 1) % 4] - p[k], v = p[(k + 3) % 4] - p[k];
    const double angle = std::atan2(u.cross(v).norm(), u.dot(v));
    sum += k % 2 == 0 ? crossing - angle : angle - (kPi - crossing);
  }
  return sum / 4;
}

// The largest and the mean shear, in degrees, of the square of cells from the node (first, first) to (last, last).
std::array<double, 2> shears(const Lattice& net, int first, int last) {
  double most = 0, sum = 0;
  for (int j = first; j < last; ++j)
    for (int i = first; i < last; ++i) {
      const double shear = std::abs(cell_shear(net, i, j)) * 180 / kPi;
      most = std::max(most, shear);
      sum += shear;
    }
  return {most, sum / ((last - first) * (last - first))};
}

TEST(GeneratorCells, DrapeAHemisphereAsPublished) {
  const exact::Sphere sphere(1);
  const double spacing = 0.075;
  const Vector2d centre(-spacing / 2, -spacing / 2);
  const auto region = [](const Vector2d& p) { return p.norm() < 0.999; };
  const Lattice net = lay_net(sphere, centre, {across(sphere, centre, kPi / 2), kPi / 2}, spacing, region, least_shear());
  const auto [most, mean] = shears(net, -11, 12);
  EXPECT_NEAR(most, 38.015, 0.011);  // KinDrape, on a hemisphere that it interpolates between points
  EXPECT_NEAR(mean, 10.534, 0.001);
  EXPECT_NEAR(most, 38.0052, 1e-4);  // its rule on the exact hemisphere
  EXPECT_NEAR(mean, 10.5334, 1e-4);
  // The strips cross over the pole, so the net is symmetric.
  for (int j = -11; j <= 12; ++j)
    for (int i = -11; i <= 12; ++i) {
      EXPECT_LT((net.at(i, j) - Vector3d(net.at(j, i).y(), net.at(j, i).x(), net.at(j, i).z())).norm(), 1e-11);
      EXPECT_NEAR(net.at(i, j).x(), -net.at(1 - i, j).x(), 1e-11);
    }
}

// KinDrape's double-curved mold, 0.5 by 0.5.
struct DoubleCurved : Surface {
  SurfaceSample sample(const Vector2d& p) const override {
    const double x = p.x(), y = p.y();
    SurfaceSample s;
    s.height =
        1.004 * x + 1.089 * y - 3.667 * x * x - 4.4 * x * y - 3.75 * y * y + 3.086 * x * x * x + 8.889 * x * x * y + 4.321 * y * y * y;
    s.gradient = {1.004 - 7.334 * x - 4.4 * y + 9.258 * x * x + 17.778 * x * y, 1.089 - 4.4 * x - 7.5 * y + 8.889 * x * x + 12.963 * y * y};
    const double xy = -4.4 + 17.778 * x;
    s.hessian << -7.334 + 18.516 * x + 17.778 * y, xy, xy, -7.5 + 25.926 * y;
    return s;
  }
};

TEST(GeneratorCells, DrapeADoubleCurvedMoldFromItsCornerAsKinDrape) {
  const DoubleCurved mold;
  const auto region = [](const Vector2d& p) { return (p.array() > -0.1).all() && (p.array() < 0.6).all(); };
  const Lattice net = lay_net(mold, {0, 0}, {across(mold, {0, 0}, kPi / 2), kPi / 2}, 0.022, region, least_shear());
  const auto [most, mean] = shears(net, 0, 20);
  EXPECT_NEAR(most, 30.135381, 1e-5);
  EXPECT_NEAR(mean, 13.367857, 1e-5);
  // From KinDrape (efficient version, solved to the last digit), with 21 by 21 nodes from the corner, spacing 0.022.
  EXPECT_LT((net.at(20, 20) - Vector3d(0.47517433, 0.40619384, 0.05940349)).norm(), 2e-8);
  EXPECT_LT((net.at(20, 0) - Vector3d(0.41702944, -0.01219473, -0.00554604)).norm(), 2e-8);
  EXPECT_LT((net.at(0, 20) - Vector3d(0.09087935, 0.38586421, 0.04741944)).norm(), 2e-8);
  EXPECT_LT((net.at(10, 10) - Vector3d(0.24576204, 0.15184158, 0.08242039)).norm(), 2e-8);
}

TEST(GeneratorCells, KeepTheCrossingAngleOfTheCentreOnAverage) {
  const exact::Hills hills(5, 0.12, {0.2, -0.1});
  const Vector2d centre(4, -3);
  for (const FibreAngles angles : {FibreAngles{0.1, 1.5}, FibreAngles{1.5, 0.1}, FibreAngles{0.2, -0.9}, FibreAngles{3.0, 1.0}}) {
    const Lattice net = lay_net(hills, centre, angles, 2.5, [](const Vector2d& p) { return p.norm() < 30; }, least_shear());
    const Vector3d u = fibre_direction(hills, centre, angles[0]), v = fibre_direction(hills, centre, angles[1]);
    const double crossing = std::atan2(u.cross(v).norm(), u.dot(v));
    const auto expect_unsheared = [&](int i, int j) {
      ASSERT_TRUE(net.has(i, j) && net.has(i + 1, j) && net.has(i, j + 1) && net.has(i + 1, j + 1)) << i << " " << j;
      EXPECT_NEAR(cell_shear(net, i, j, crossing), 0, 1e-11) << i << " " << j;
    };
    for (int n = -7; n <= 6; ++n) expect_unsheared(n, 0), expect_unsheared(0, n);
    const Vector3d second = net.at(0, 1) - net.at(0, 0);
    EXPECT_NEAR(std::remainder(std::atan2(second.y(), second.x()) - angles[1], 2 * kPi), 0, 1e-12);
    const Net numbered = number_nodes(net, std::vector<std::uint8_t>(net.nodes.size(), 1));
    for (const auto& [a, b] : segments(numbered.neighbours)) ASSERT_NEAR((numbered.nodes[a] - numbered.nodes[b]).norm(), 2.5, 1e-11);
  }
}

TEST(GeneratorCells, EndWhereTheSurfaceOrTheRegionDoes) {
  const exact::Sphere sphere(50);
  const auto everywhere = [](const Vector2d&) { return true; };
  const Lattice net = lay_net(sphere, {10, 20}, {0, kPi / 2}, 4, everywhere, least_shear());
  EXPECT_GT(net.columns(), 20);
  EXPECT_LT(net.columns(), 50);
  const Lattice small = lay_net(sphere, {10, 15}, {0, kPi / 2}, 4, [](const Vector2d& p) { return p.norm() < 25; }, least_shear());
  EXPECT_GT(small.nodes.size(), 50U);
  for (const Vector3d& p : small.nodes)
    if (p.allFinite()) {
      EXPECT_LT(p.head<2>().norm(), 25);
    }
}

// A wall that grows steeper and steeper past x = 10.
struct Wall : Surface {
  SurfaceSample sample(const Vector2d& p) const override {
    const double past = std::max(0.0, p.x() - 10);
    return {100 * past * past, {200 * past, 0}, Eigen::Matrix2d::Zero()};
  }
};

TEST(LayNet, SaysWhereAPathIsTrappedOnASlope) {
  const std::vector<Vector2d> outline{{-20, -20}, {40, -20}, {40, 20}, {-20, 20}};
  for (const PathRule rule : {PathRule::vertical_plane, PathRule::geodesic}) {
    LayOptions options;
    options.paths = rule;
    const std::string said = message([&] { Drape(Wall(), {0, 0}, {0, kPi / 2}, 1, outline, options); });
    EXPECT_EQ(said.rfind("paths: expected paths that cross the region", 0), 0U) << said;
    EXPECT_EQ(said.find("choose \"geodesic\"") != std::string::npos, rule == PathRule::vertical_plane);
    EXPECT_NE(said.find("trapped: the fibre at 0 degrees comes at (10.0998, 0) to a slope of up to 89"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace debulk::generator_cells_test
