#include "debulk/ridge/string_bound.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "debulk/core/error.hpp"
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

}  // namespace
}  // namespace debulk
