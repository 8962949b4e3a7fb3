#include "debulk/ridge/held_excess.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "debulk/net/fibre_net.hpp"
#include "debulk/ridge/mold_length.hpp"
#include "test_nets.hpp"

namespace debulk {
namespace {

using test::Cylinder;
using test::Plane;

Net as_net(const test::TestNet& given, NodeKind ends) {
  Net net;
  net.nodes = given.nodes;
  net.neighbours = given.neighbours;
  net.inside = given.inside;
  for (const Neighbours& n : net.neighbours) net.kinds.push_back(n[east] < 0 || n[west] < 0 ? ends : NodeKind::inner);
  return net;
}

TEST(HeldExcess, CountsFibresWithBothEndsFixed) {
  const auto points = test::profile({0, 2, 3, 1, 0}, 8);
  Net net = as_net(test::extruded({0, 2, 3, 1, 0}, 8, 3), NodeKind::fixed);
  const HeldExcess all = held_excess(net, Plane());
  EXPECT_NEAR(all.largest, 32 - points.back().x(), 1e-12);
  // Three along the first direction; along the second, the two through fixed nodes, which lie on the mold.
  EXPECT_EQ(all.fibres, 5);
  for (std::size_t k = 0; k < net.kinds.size(); k += 5) net.kinds[k] = NodeKind::free;
  const HeldExcess loose = held_excess(net, Plane());
  EXPECT_EQ(loose.fibres, 1);
  EXPECT_NEAR(loose.largest, 0, 1e-12);
}

struct Bell : Surface {
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s;
    const double h = 5 * std::exp(-p.squaredNorm() / 400);
    s.height = h;
    s.gradient = -p * h / 200;
    s.hessian = p * p.transpose() * h / 40000 - Eigen::Matrix2d::Identity() * h / 200;
    return s;
  }
};

TEST(HeldExcess, GrowsWithTheSquareOfTheSpacing) {
  PocketShape shape;
  shape.angles = {0, 1.5707963267948966};
  for (int k = 0; k < 120; ++k) shape.outline.emplace_back(50 * std::cos(k * 0.05235987755982989), 50 * std::sin(k * 0.05235987755982989));
  const auto at = [&](double spacing) {
    FibreNetOptions options;
    options.spacing = spacing;
    return held_excess(fibre_net(Bell(), Plane(), shape, options).net, Plane()).largest;
  };
  const double limit = at(0.75), coarse = at(9), half = at(4.5);
  EXPECT_LT(coarse, 0.99 * limit);
  EXPECT_LT(std::abs(half + (half - coarse) / 3 - limit), 0.25 * (limit - half));
}

}  // namespace
}  // namespace debulk
