#include "debulk/ridge/string_bound.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "debulk/core/error.hpp"
#include "debulk/net/fibre_net.hpp"
#include "debulk/ridge/held_excess.hpp"
#include "test_nets.hpp"

namespace debulk {
namespace {

using test::Plane;

// z = a x^2 + c y^2.
struct Parabolic : Surface {
  double a, c;
  Parabolic(double xx, double yy) : a(xx), c(yy) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s;
    s.height = a * p.x() * p.x() + c * p.y() * p.y();
    s.gradient = {2 * a * p.x(), 2 * c * p.y()};
    s.hessian << 2 * a, 0, 0, 2 * c;
    return s;
  }
};

Polygon circle(double radius) {
  Polygon out;
  for (int k = 0; k < 120; ++k) out.emplace_back(radius * std::cos(k * M_PI / 60), radius * std::sin(k * M_PI / 60));
  return out;
}

constexpr FibreAngles kStraight{0.0, M_PI / 2}, kDiagonal{M_PI / 4, -M_PI / 4};

TEST(StringBound, IsTheSagOfAHollowAndNothingOverAHill) {
  const Polygon square{{-30, -30}, {30, -30}, {30, 30}, {-30, 30}};  // most lines pass far from its corners
  Plane tilted;
  tilted.slope = {0.2, -0.1};
  for (const Polygon& outline : {square, circle(30)}) {
    EXPECT_NEAR(string_bound(outline, 6, kStraight, Parabolic(1.0 / 300, 0)), 36.0 * 36.0 / 300, 0.1);
    EXPECT_NEAR(string_bound(outline, 6, kStraight, Parabolic(0, 1.0 / 300)), 36.0 * 36.0 / 300, 0.1);
    EXPECT_EQ(string_bound(outline, 6, kStraight, Parabolic(-1.0 / 300, -1.0 / 300)), 0.0);
    EXPECT_NEAR(string_bound(outline, 6, kStraight, tilted), 0.0, 1e-9);
  }
  // Along the diagonals a saddle is straight, along the axes it is hollow one way.
  EXPECT_NEAR(string_bound(circle(30), 6, kDiagonal, Parabolic(1.0 / 300, -1.0 / 300)), 0.0, 1e-9);
  EXPECT_THROW(string_bound(square, 0, kStraight, Plane()), InputError);
}

// A hollow round a place, and a slope.
struct Dish : Surface {
  Eigen::Vector2d middle;
  double deep, wide;
  Dish(const Eigen::Vector2d& at, double d, double w) : middle(at), deep(d), wide(w) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s;
    const Eigen::Vector2d d = p - middle;
    s.height = -deep * std::exp(-d.squaredNorm() / (2 * wide * wide));
    s.gradient = -s.height * d / (wide * wide);
    s.hessian = s.height * (d * d.transpose() / std::pow(wide, 4) - Eigen::Matrix2d::Identity() / (wide * wide));
    return s;
  }
};

TEST(StringBound, IsNoLessThanThatOfANet) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-30, 30), deep(1, 6), wide(6, 25), turn(0, M_PI / 2), spacing(5, 12);
  int bridging = 0;
  for (int n = 0; n < 40; ++n) {
    const Dish mold({place(random), place(random)}, deep(random), wide(random));
    PocketShape shape;
    const double angle = turn(random);
    shape.angles = {angle, angle + M_PI / 2};
    shape.outline = circle(40);
    FibreNetOptions options;
    options.spacing = spacing(random);
    const PocketNet laid = fibre_net(Plane(), Plane(), shape, options);
    const double net = held_excess(laid.net, mold).bridge_bound;
    bridging += net > 0.1;
    EXPECT_GE(string_bound(shape.outline, *options.spacing, shape.angles, mold), 0.98 * net) << n;
  }
  EXPECT_GT(bridging, 30);
}

}  // namespace
}  // namespace debulk
