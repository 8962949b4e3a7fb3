#include "debulk/surface/datum.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

template <class Height>
Reference reference(const Height& height, double spacing = 1.0) {
  Grid<double> nodes(81, 61, {-40 * spacing, -30 * spacing}, spacing);
  for (int j = 0; j < nodes.ny; ++j)
    for (int i = 0; i < nodes.nx; ++i) nodes.at(i, j) = height(nodes.position(i, j));
  return Reference(nodes);
}

TEST(Datum, OfAPlaneStandsHigherByTheSecantOfItsSlope) {
  for (const double slope : {0.1, 1.0, 1.9}) {
    const Reference mold = reference([&](const Eigen::Vector2d& xy) { return slope * (0.6 * xy.x() - 0.8 * xy.y()); });
    const Reference raised = datum(mold, 0.3);
    for (const Eigen::Vector2d& xy : {Eigen::Vector2d(0, 0), Eigen::Vector2d(-40, 30), Eigen::Vector2d(12.3, -4.5)})
      EXPECT_NEAR(raised.height(xy) - mold.height(xy), 0.3 * (std::hypot(1, slope) - 1), 1e-9) << slope;
  }
}

TEST(Datum, OfACylinderIsTheCylinderThatIsThickerByThePly) {
  for (const double radius : {15.0, -15.0})  // a ridge and a hollow, up to a slope of 62 degrees
    for (const double thickness : {0.13, 0.6}) {
      const auto arc = [&](double r, double x) { return std::copysign(std::sqrt(r * r - x * x), r); };
      const double reach = 15 * std::sin(62 * M_PI / 180);
      const Reference mold = reference([&](const Eigen::Vector2d& xy) { return arc(radius, xy.x()); }, 0.35);
      const Reference raised = datum(mold, thickness);
      for (const double x : {0.0, 0.3 * reach, 0.7 * reach, reach})
        EXPECT_NEAR(raised.height({x, 1.1}) + thickness, arc(radius + thickness, x), 2e-4) << radius << " " << x;
    }
}

TEST(Datum, OfAFlatMoldIsTheMoldToTheLastBit) {
  const Reference mold = reference([](const Eigen::Vector2d& xy) { return 0.01 * std::sin(xy.x()) - 7; });
  EXPECT_EQ(datum(mold, 0.3).heights().values, mold.heights().values);
  const Reference steep = reference([](const Eigen::Vector2d& xy) { return xy.x(); });
  EXPECT_EQ(datum(steep, 0.0).heights().values, steep.heights().values);
}

TEST(Datum, RefusesAThicknessThatIsNone) {
  const Reference mold = reference([](const Eigen::Vector2d&) { return 0.0; });
  EXPECT_THROW(datum(mold, -0.1), InputError);
  EXPECT_THROW(datum(mold, std::nan("")), InputError);
}

}  // namespace
}  // namespace debulk
