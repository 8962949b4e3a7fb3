#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

// Exact molds and hand-made nets for the tests of this room.
namespace debulk::test {

struct Plane : Surface {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  double offset = 0;
  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    SurfaceSample s;
    s.height = offset + slope.dot(xy);
    s.gradient = slope;
    return s;
  }
};

// A cylinder along y through the origin: a hill for radius > 0, a hollow for radius < 0.
struct Cylinder : Surface {
  explicit Cylinder(double r) : radius(r) {}
  double radius;
  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    const double x = xy.x(), root = std::sqrt(radius * radius - x * x), sign = radius > 0 ? 1 : -1;
    SurfaceSample s;
    s.height = sign * (root - std::abs(radius));
    s.gradient.x() = -sign * x / root;
    s.hessian(0, 0) = -sign * radius * radius / (root * root * root);
    return s;
  }
};

struct TestNet {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<Neighbours> neighbours;
  std::vector<std::uint8_t> inside;
};

// columns x rows nodes, number j * columns + i at place(i, j); the first fibre runs along i, the second along j.
inline TestNet make_net(int columns, int rows, const std::function<Eigen::Vector3d(int, int)>& place) {
  TestNet net;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      const int k = j * columns + i;
      net.nodes.push_back(place(i, j));
      net.neighbours.push_back(
          {i + 1 < columns ? k + 1 : -1, i > 0 ? k - 1 : -1, j + 1 < rows ? k + columns : -1, j > 0 ? k - columns : -1});
      net.inside.push_back(1);
    }
  return net;
}

// Points (s, z) of an inextensible profile with the given heights at node spacing `spacing`, starting at s = 0.
inline std::vector<Eigen::Vector2d> profile(const std::vector<double>& heights, double spacing) {
  std::vector<Eigen::Vector2d> points;
  double s = 0;
  for (std::size_t k = 0; k < heights.size(); ++k) {
    if (k > 0) s += std::sqrt(spacing * spacing - std::pow(heights[k] - heights[k - 1], 2));
    points.emplace_back(s, heights[k]);
  }
  return points;
}

// The profile along the first fibre, the same in `rows` rows at node spacing, every node moved by `pose`.
inline TestNet extruded(const std::vector<double>& heights, double spacing, int rows,
                        const Eigen::Isometry3d& pose = Eigen::Isometry3d::Identity()) {
  const auto points = profile(heights, spacing);
  return make_net(static_cast<int>(heights.size()), rows,
                  [&](int i, int j) -> Eigen::Vector3d { return pose * Eigen::Vector3d(points[i].x(), spacing * j, points[i].y()); });
}

}  // namespace debulk::test
