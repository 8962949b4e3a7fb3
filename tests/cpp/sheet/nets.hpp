#pragma once

#include "debulk/core/stop.hpp"
#include "support/shapes.hpp"

// Nets for tests of the minimisation and of its certificate, and a mold that stops it.
namespace debulk::test {

// A ridge along y on a plane, its border fixed: fibres bent in the xz plane, and straight ones along y.
inline Net ridge_net(int columns, int rows, double angle, double spacing = 5.0) {
  Net net = flat_net(columns, rows, spacing);
  for (int j = 0; j < rows; ++j) {
    Eigen::Vector3d at(0, j * spacing, 0);
    for (int i = 0; i < columns; ++i) {
      net.nodes[static_cast<std::size_t>(j * columns + i)] = at;
      const double turn = angle * std::cos(M_PI * (i + 0.5) / (columns - 1));
      at += spacing * Eigen::Vector3d(std::cos(turn), 0, std::sin(turn));
    }
  }
  return net;
}

// One fibre through these points, the first `fixed` of them held.
inline Net chain(const std::vector<Eigen::Vector3d>& points, int fixed, double spacing) {
  Net net;
  net.spacing = spacing;
  net.nodes = points;
  const int count = static_cast<int>(points.size());
  for (int i = 0; i < count; ++i) {
    net.neighbours.push_back({i + 1 < count ? i + 1 : -1, i - 1, -1, -1});
    net.kinds.push_back(i < fixed ? NodeKind::fixed : NodeKind::inner);
    net.inside.push_back(i >= fixed);
  }
  return net;
}

// A mold that raises a flag when it has been asked often enough: a stop in the middle of a solve, without a clock.
struct Impatient : Plane {
  explicit Impatient(long most) : left(most) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    if (--left == 0) stop.cancel();
    return Plane::sample(p);
  }
  mutable long left;
  Stop stop;
};

}  // namespace debulk::test
