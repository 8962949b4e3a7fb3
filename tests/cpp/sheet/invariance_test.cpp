// The energy does not know where the mold stands, how its nodes are numbered, or what a millimetre is.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <memory>
#include <numeric>

#include "debulk/sheet/sheet.hpp"
#include "support/shapes.hpp"

namespace debulk::invariance_test {
namespace {

constexpr double kSpacing = 5.0;

struct Moved : Surface {
  const Surface& base;
  Eigen::Rotation2D<double> turn;
  Eigen::Vector2d by;
  double scale;
  Moved(const Surface& on, double angle, const Eigen::Vector2d& shift, double factor) : base(on), turn(angle), by(shift), scale(factor) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s = base.sample(turn.inverse() * (p - by) / scale);
    s.height *= scale;
    s.gradient = turn * s.gradient;
    s.hessian = turn.toRotationMatrix() * s.hessian * turn.toRotationMatrix().transpose() / scale;
    return s;
  }
};

const test::Quadric kMold(0.004, 0.002, -0.003);

Net net_at_rest() {
  Net net = test::flat_net(7, 6, kSpacing);
  net.kinds[3] = NodeKind::free;
  for (Eigen::Vector3d& p : net.nodes) p.z() = kMold.height(p.head<2>());
  return net;
}

Points lowered(const Net& net) {
  return test::shaken(net.nodes, 0.6, 9);
}

TEST(Invariance, OfTheEnergyUnderMotionAndScale) {
  const Net net = net_at_rest();
  const double area = 700.0, energy = Sheet(net, area, PlyMaterial(), std::make_shared<test::Quadric>(kMold)).energy(lowered(net));
  for (const double angle : {0.0, 0.7, 2.5})
    for (const double shift : {0.0, 137.0, 1e7})
      for (const double scale : {1.0, 0.1, 30.0}) {
        const Eigen::Vector2d by(shift, -0.3 * shift);
        const Eigen::Rotation2D<double> turn(angle);
        const auto move = [&](Points points) {
          for (Eigen::Vector3d& p : points) {
            p *= scale;
            p.head<2>() = turn * p.head<2>() + by;
          }
          return points;
        };
        Net moved = net;
        moved.nodes = move(net.nodes);
        moved.spacing = scale * net.spacing;
        // Lengths times s: moduli over s^0 with thickness times s make energies times s^3; so does a pressure of old.
        PlyMaterial ply;
        ply.thickness_mm *= scale;
        ply.density_kg_m3 /= scale;  // a weight goes with s^3 too, its work with s^4
        const Sheet sheet(moved, scale * scale * area, ply, std::make_shared<Moved>(kMold, angle, by, scale));
        const double same = sheet.energy(move(lowered(net))) / (scale * scale * scale);
        // At 10 km a coordinate is rounded to 1e-9 mm; so is what enters.
        const double tolerance = shift < 1e6 ? 1e-9 : 1e-9 / scale;
        EXPECT_NEAR(same / energy, 1.0, tolerance) << angle << ' ' << shift << ' ' << scale;
      }
}

TEST(Invariance, OfTheEnergyUnderNumbering) {
  const Net net = net_at_rest();
  const Points x = lowered(net);
  const double energy = Sheet(net, 700.0, PlyMaterial(), std::make_shared<test::Quadric>(kMold)).energy(x);
  std::vector<std::size_t> order(net.nodes.size());
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 engine(3);
  for (int round = 0; round < 5; ++round) {
    for (std::size_t i = order.size() - 1; i > 0; --i) std::swap(order[i], order[engine() % (i + 1)]);
    Net other = net;
    Points y(x.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::size_t to = order[i];
      other.nodes[to] = net.nodes[i];
      other.kinds[to] = net.kinds[i];
      y[to] = x[i];
      for (std::size_t d = 0; d < 4; ++d) {
        const int j = net.neighbours[i][d];
        other.neighbours[to][d] = j < 0 ? -1 : static_cast<int>(order[static_cast<std::size_t>(j)]);
      }
    }
    EXPECT_NEAR(Sheet(other, 700.0, PlyMaterial(), std::make_shared<test::Quadric>(kMold)).energy(y) / energy, 1.0, 1e-12);
  }
}

}  // namespace
}  // namespace debulk::invariance_test
