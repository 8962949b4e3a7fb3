// Straight lines over a foot have the length of the surface's own quadrature, and are held where the ply goes on.

#include "debulk/ridge/straight_fibres.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "test_nets.hpp"

namespace debulk {
namespace {

using test::Cylinder;
using test::Plane;
using Shape = std::function<double(const Eigen::Vector2d&)>;

const double kPi = std::acos(-1.0);
constexpr double kRadius = 60;  // mm, of the foot

// A squared cosine, w wide at its foot.
Shape bell(double x, double y, double w, double h) {
  return [=](const Eigen::Vector2d& xy) {
    const double r = (xy - Eigen::Vector2d(x, y)).norm() / w;
    return r < 0.5 ? h * std::pow(std::cos(kPi * r), 2) : 0.0;
  };
}

// A disc on which the ply's lower side stands as the shape says.
FootMap foot_of(const Shape& shape) {
  FootMap feet;
  const int n = 301;
  feet.heights = Grid<float>(n, n, {-75, -75}, 0.5);
  feet.labels = Grid<std::int32_t>(n, n, {-75, -75}, 0.5);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d xy = feet.heights.position(i, j);
      feet.heights.at(i, j) = static_cast<float>(feet.options.thickness_mm + shape(xy));
      feet.labels.at(i, j) = xy.norm() < kRadius ? 1 : 0;
    }
  Foot foot;
  foot.label = 1;
  for (int k = 0; k < 90; ++k) foot.outline.emplace_back(kRadius * std::cos(k * kPi / 45), kRadius * std::sin(k * kPi / 45));
  feet.feet.push_back(foot);
  return feet;
}

// Over the mold, along a line through a point; by steps of a hundredth of a millimetre.
double exact_excess(const Shape& shape, const Surface& mold, const Eigen::Vector2d& through, double angle) {
  const Eigen::Vector2d way(std::cos(angle), std::sin(angle));
  const double step = 0.01;
  double excess = 0;
  for (double s = -140; s < 140; s += step) {
    const Eigen::Vector2d a = through + s * way, b = a + step * way;
    const double rise = mold.height(b) - mold.height(a);
    excess += std::hypot(step, rise + shape(b) - shape(a)) - std::hypot(step, rise);
  }
  return excess;
}

TEST(StraightFibres, AreAsLongAsTheSurfaceSays) {
  Plane plane;
  plane.slope = {0.2, -0.1};
  const Cylinder hill(400), hollow(-400);
  const Shape shape = bell(0, 0, 110, 7);
  for (const Surface* mold :
       {static_cast<const Surface*>(&plane), static_cast<const Surface*>(&hill), static_cast<const Surface*>(&hollow)})
    for (const double turn : {0.0, 0.4}) {
      const FootMap feet = foot_of(shape);
      const FibreAngles angles{turn, turn + kPi / 2};
      const auto lines = straight_fibres(feet, feet.feet[0], *mold, angles, {});
      ASSERT_EQ(lines.size(), 2u);
      for (int k = 0; k < 2; ++k) EXPECT_NEAR(lines[k].excess, exact_excess(shape, *mold, {0, 0}, angles[k]), 0.005) << turn << " " << k;
    }
}

TEST(StraightFibres, PassOverABumpThatRidesOnAPocket) {
  const Shape wide = bell(0, 0, 110, 5), rider = bell(21, 17, 12, 1.5);
  const Shape both = [&](const Eigen::Vector2d& xy) { return wide(xy) + rider(xy); };
  const FootMap feet = foot_of(both);
  const auto lines = straight_fibres(feet, feet.feet[0], Plane(), {0, kPi / 2}, {});
  const double at_top = exact_excess(both, Plane(), {21, 17}, 0);
  EXPECT_GT(lines[0].excess, 0.93 * at_top);                                                     // a millimetre beside it at most
  EXPECT_NEAR(lines[0].excess, exact_excess(both, Plane(), lines[0].points.front(), 0), 0.025);  // chords
  EXPECT_NEAR(lines[0].points.front().y(), 17, 1.01);                                            // they are 2 mm apart
  EXPECT_NEAR(lines[1].points.front().x(), 21, 1.01);
}

TEST(StraightFibres, CountWhereThePlyGoesOnBeyondBothEnds) {
  const FootMap feet = foot_of(bell(0, 0, 110, 5));
  const auto over = [&](const Polygon& ply, double way) { return straight_fibres(feet, feet.feet[0], Plane(), {0, kPi / 2}, {ply, way}); };
  const Polygon strip{{-70, -200}, {70, -200}, {70, 200}, {-70, 200}};  // its edges 10 mm beside the foot
  const auto all = over({}, 20), some = over(strip, 20), near = over(strip, 5);
  EXPECT_LT(some[0].excess, 0.5 * all[0].excess);  // only short ones, which end far from the edges
  EXPECT_EQ(some[1].excess, all[1].excess);
  EXPECT_EQ(near[0].excess, all[0].excess);
  EXPECT_EQ(over({{-50, -50}, {50, -50}, {50, 50}, {-50, 50}}, 500)[0].points.size(), 0u);
}

TEST(StraightFibres, AreTwoWhereFrictionHoldsThePartsOfAFootApart) {
  const Shape left = bell(-40, 0, 30, 3), right = bell(40, 0, 30, 3);
  FootMap feet = foot_of([&](const Eigen::Vector2d& xy) { return left(xy) + right(xy); });
  feet.mold_tol_mm = 0.2;
  const double one = exact_excess(left, Plane(), {-40, 0}, 0);
  const auto lines = [&](double apart) { return straight_fibres(feet, feet.feet[0], Plane(), {0, kPi / 2}, {{}, 0, apart}); };
  EXPECT_NEAR(lines(60)[0].excess, 2 * one, 0.02);
  EXPECT_NEAR(lines(40)[0].excess, one, 0.01);
  EXPECT_EQ(lines(60)[1].excess, lines(40)[1].excess);
  for (int j = 0; j < feet.labels.ny; ++j)
    for (int i = 0; i < feet.labels.nx; ++i)
      if (std::abs(feet.labels.position(i, j).x()) < 22) feet.labels.at(i, j) = 0;  // off the foot
  EXPECT_NEAR(lines(60)[0].excess, 2 * one, 0.02);
  EXPECT_NEAR(lines(40)[0].excess, one, 0.01);
}

TEST(StraightFibres, PassUnknownHeightsAndEmptyFeet) {
  FootMap feet = foot_of(bell(0, 0, 110, 5));
  for (int i = 100; i < 200; ++i) feet.heights.at(i, 150) = std::numeric_limits<float>::quiet_NaN();
  for (const StraightFibre& line : straight_fibres(feet, feet.feet[0], Plane(), {0, kPi / 2}, {})) EXPECT_TRUE(std::isfinite(line.excess));
  std::fill(feet.heights.values.begin(), feet.heights.values.end(), std::numeric_limits<float>::quiet_NaN());
  for (const StraightFibre& line : straight_fibres(feet, feet.feet[0], Plane(), {0, kPi / 2}, {})) EXPECT_EQ(line.excess, 0);
  std::fill(feet.labels.values.begin(), feet.labels.values.end(), 0);
  for (const StraightFibre& line : straight_fibres(feet, feet.feet[0], Plane(), {0, kPi / 2}, {})) EXPECT_TRUE(line.points.empty());
  EXPECT_EQ(straight_fibres(feet, Foot(), Plane(), {0, kPi / 2}, {})[0].excess, 0);
}

// Beside the edge the filters know no height: a ply that ends there in the air does not step down to the mold.
TEST(StraightFibres, DoNotStepDownBesideThePlysEdge) {
  FootMap feet = foot_of(bell(0, 0, 110, 5));
  for (int j = 0; j < feet.labels.ny; ++j)
    for (int i = 0; i < feet.labels.nx; ++i) {
      const double x = feet.labels.position(i, j).x();
      if (x > 9.4) feet.heights.at(i, j) = std::numeric_limits<float>::quiet_NaN();
      if (x > 10) feet.labels.at(i, j) = 0;
    }
  const auto along = [&](const Polygon& ply) { return straight_fibres(feet, feet.feet[0], Plane(), {0}, {ply, 0})[0].excess; };
  const double up = along({{-70, -70}, {10, -70}, {10, 70}, {-70, 70}}), down = along({});
  const double flank =
      exact_excess([&](const Eigen::Vector2d& xy) { return bell(0, 0, 110, 5)({std::min(xy.x(), 9.4), xy.y()}); }, Plane(), {0, 0}, 0);
  EXPECT_NEAR(up, flank, 0.02);
  EXPECT_GT(down, up + 2);  // what a hole hides may lie on the mold
}

TEST(StraightFibres, EndWithTheStop) {
  const FootMap feet = foot_of(bell(0, 0, 110, 5));
  const Stop stop;
  stop.cancel();
  EXPECT_THROW(straight_fibres(feet, feet.feet[0], Plane(), {0, kPi / 2}, {}, stop), Stopped);
}

}  // namespace
}  // namespace debulk
