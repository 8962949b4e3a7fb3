#include "debulk/ridge/mold_length.hpp"

#include <gtest/gtest.h>

#include <string>

#include "debulk/core/error.hpp"
#include "test_nets.hpp"

namespace debulk {
namespace {

using test::Cylinder;
using test::extruded;
using test::Plane;

TEST(ClosestPoint, OnATiltedPlaneIsTheFootOfTheNormal) {
  Plane plane;
  plane.slope = {0.5, -0.3};
  plane.offset = 7;
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.5, 0.3, 1).normalized();
  for (const double h : {-0.01, 0.0, 0.2, 5.0}) {
    const Eigen::Vector3d foot(12, -4, plane.height({12, -4}));
    EXPECT_LT((closest_point(plane, foot + h * normal) - foot).norm(), 1e-12);
  }
}

TEST(ClosestPoint, OnCylindersIsRadial) {
  for (const double radius : {40.0, 500.0, -40.0, -500.0}) {
    const Cylinder cylinder(radius);
    const Eigen::Vector3d centre(0, 0, -radius);
    for (const double x : {-20.0, 0.0, 3.0, 15.0})
      for (const double h : {0.0, 0.1, 4.0}) {
        const Eigen::Vector3d foot(x, 2, cylinder.height({x, 2}));
        const Eigen::Vector3d out = Eigen::Vector3d(x, 0, foot.z() - centre.z()).normalized() * (radius > 0 ? 1 : -1);
        EXPECT_LT((closest_point(cylinder, foot + h * out) - foot).norm(), 1e-9) << radius << " " << x << " " << h;
      }
  }
}

TEST(LargestFibreExcess, IsThatOfTheLongestFibre) {
  const double spacing = 8;
  const auto points = test::profile({0, 3, 0, 1, 0}, spacing);
  const auto net = extruded({0, 3, 0, 1, 0}, spacing, 3);
  EXPECT_NEAR(largest_fibre_excess(net.nodes, net.neighbours, Plane()), 4 * spacing - points.back().x(), 1e-12);
}

TEST(LargestFibreExcess, SeesTheSecondFibreToo) {
  auto net = extruded({0, 3, 0}, 8, 2);
  for (auto& n : net.neighbours) std::swap(n[0], n[2]), std::swap(n[1], n[3]);
  EXPECT_NEAR(largest_fibre_excess(net.nodes, net.neighbours, Plane()), 16 - 2 * std::sqrt(64.0 - 9.0), 1e-12);
}

TEST(LargestFibreExcess, OfANetFlushWithACurvedMoldIsNothing) {
  const double radius = 300, spacing = 8, angle = 2 * std::asin(spacing / 2 / radius);
  for (const double sign : {1.0, -1.0}) {
    const Cylinder mold(sign * radius);
    const auto net = test::make_net(11, 3, [&](int i, int j) {
      const double a = (i - 5) * angle;
      return Eigen::Vector3d(radius * std::sin(a), spacing * j, sign * radius * (std::cos(a) - 1));
    });
    // Chords of equal XY length against chords of equal length: what is left is of fourth order in the span.
    EXPECT_NEAR(largest_fibre_excess(net.nodes, net.neighbours, mold), 0.0, 1e-5);
  }
}

TEST(LargestFibreExcess, IgnoresRingsAndLoneNodes) {
  const std::vector<Neighbours> ring = {{1, 2, -1, -1}, {2, 0, -1, -1}, {0, 1, -1, -1}, {-1, -1, -1, -1}};
  const std::vector<Eigen::Vector3d> nodes = {{0, 0, 0}, {1, 0, 1}, {0, 1, 0}, {5, 5, 5}};
  EXPECT_EQ(largest_fibre_excess(nodes, ring, Plane()), 0.0);
}

TEST(CheckNodes, NamesThePlace) {
  const auto message = [](const std::vector<Neighbours>& neighbours, std::size_t count) -> std::string {
    try {
      check_nodes(std::vector<Eigen::Vector3d>(count, Eigen::Vector3d::Zero()), neighbours);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  const auto good = extruded({0, 0, 0}, 1, 2).neighbours;
  EXPECT_EQ(message(good, 6), "");
  EXPECT_NE(message(good, 5).find("6 rows"), std::string::npos);
  auto bad = good;
  bad[2][north] = 6;
  EXPECT_NE(message(bad, 6).find("6 at row 2, column 2"), std::string::npos);
  bad = good;
  bad[0][west] = -2;
  EXPECT_NE(message(bad, 6).find("-2 at row 0, column 1"), std::string::npos);
  bad = good;
  bad[0][east] = 4;  // whose west is 3
  EXPECT_NE(message(bad, 6).find("4 at row 0, column 0"), std::string::npos);
}

}  // namespace
}  // namespace debulk
