#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

// Exact surfaces and small nets for tests.
namespace debulk::test {

struct Plane : Surface {
  double slope_x = 0, slope_y = 0;
  Plane() = default;
  Plane(double sx, double sy) : slope_x(sx), slope_y(sy) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s;
    s.height = slope_x * p.x() + slope_y * p.y();
    s.gradient = {slope_x, slope_y};
    return s;
  }
};

// z = a x^2 + b x y + c y^2.
struct Quadric : Surface {
  double a, b, c;
  Quadric(double xx, double xy, double yy) : a(xx), b(xy), c(yy) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s;
    s.height = a * p.x() * p.x() + b * p.x() * p.y() + c * p.y() * p.y();
    s.gradient = {2 * a * p.x() + b * p.y(), b * p.x() + 2 * c * p.y()};
    s.hessian << 2 * a, b, b, 2 * c;
    return s;
  }
};

// cos^2 bell of height H and radius R on another surface; twice differentiable but at its foot, where F'' jumps.
struct Bell : Surface {
  const Surface& base;
  double height, radius;
  Bell(const Surface& on, double h, double r) : base(on), height(h), radius(r) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s = base.sample(p);
    const double r = p.norm(), k = M_PI / (2 * radius);
    if (r >= radius) return s;
    const double f1 = -height * k * std::sin(2 * k * r), f2 = -2 * height * k * k * std::cos(2 * k * r);
    const double over_r = r > 1e-9 ? f1 / r : f2;
    s.height += height * std::pow(std::cos(k * r), 2);
    s.gradient += over_r * p;
    s.hessian += over_r * Eigen::Matrix2d::Identity();
    if (r > 1e-9) s.hessian += (f2 - over_r) * p * p.transpose() / (r * r);
    return s;
  }
};

// columns x rows nodes in the plane z = 0 at right angles, numbered row by row; the border fixed if asked.
inline Net flat_net(int columns, int rows, double spacing, bool fixed_border = true) {
  Net net;
  net.spacing = spacing;
  const auto number = [&](int i, int j) { return i < 0 || j < 0 || i >= columns || j >= rows ? -1 : j * columns + i; };
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < columns; ++i) {
      net.nodes.emplace_back(i * spacing, j * spacing, 0.0);
      net.neighbours.push_back({number(i + 1, j), number(i - 1, j), number(i, j + 1), number(i, j - 1)});
      const bool border = i == 0 || j == 0 || i == columns - 1 || j == rows - 1;
      net.kinds.push_back(border && fixed_border ? NodeKind::fixed : NodeKind::inner);
      net.inside.push_back(!border);
    }
  return net;
}

inline std::vector<Eigen::Vector3d> shaken(std::vector<Eigen::Vector3d> points, double amplitude, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> u(-amplitude, amplitude);
  for (Eigen::Vector3d& p : points) p += Eigen::Vector3d(u(engine), u(engine), u(engine));
  return points;
}

}  // namespace debulk::test
