// Lines cover the ply, end at its edge, and follow a field of angles.

#include "debulk/fibre/fibre_lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"

namespace debulk::fibre_lines_test {
namespace {

const Polygon kSquare{{0, 0}, {100, 0}, {100, 100}, {0, 100}};
const Box kBox{{0, 0}, {100, 100}};

// Length of all lines of a family, times their distance: the area that they cover.
double covered(const std::vector<FibreLine>& lines, int family, double apart) {
  double length = 0;
  for (const FibreLine& line : lines)
    if (line.family == family) length += line.length() + line.step;
  return length * apart;
}

TEST(FibreLines, CoverThePlyInBothDirectionsAtAnyAngle) {
  FibreOptions options;
  for (const double degrees : {0.0, 37.0, 90.0, 135.0, -20.0}) {
    const double angle = degrees * M_PI / 180;
    const auto lines = straight_lines({angle, angle + M_PI / 2}, kSquare, kBox, options);
    for (const int family : {0, 1}) EXPECT_NEAR(covered(lines, family, options.apart), 1e4, 350) << degrees;
    for (const FibreLine& line : lines) {
      EXPECT_TRUE(inside(kSquare, line.at(1)) || distance_to_outline(kSquare, line.at(1)) < 1e-9);
      EXPECT_TRUE(line.to_edge[0] && line.to_edge[1]);
    }
  }
}

TEST(FibreLines, AreDividedByACutOut) {
  Polygon ply = kSquare;
  for (const Eigen::Vector2d& p : {ply[0], Eigen::Vector2d(40, 40), {40, 60}, {60, 60}, {60, 40}, {40, 40}}) ply.push_back(p);
  const FibreOptions options;
  const AngleField field(2, 2, {0, 0}, 100.0, Eigen::Vector2d(0, M_PI / 2));
  for (const auto& lines : {straight_lines({0, M_PI / 2}, ply, kBox, options), field_lines(field, ply, kBox, options, Stop())}) {
    for (const int family : {0, 1}) EXPECT_NEAR(covered(lines, family, options.apart), 9600, 350);
    for (const FibreLine& line : lines) {
      EXPECT_TRUE(line.to_edge[0] && line.to_edge[1]);
      for (int k = 1; k + 1 < line.count; ++k)
        EXPECT_TRUE(inside(ply, line.at(k)) || distance_to_outline(ply, line.at(k)) < 1e-4) << line.at(k).transpose();
    }
  }
}

TEST(FibreLines, AreDividedByANotch) {
  const Polygon notched{{0, 0}, {100, 0}, {100, 100}, {60, 100}, {60, 30}, {40, 30}, {40, 100}, {0, 100}};
  int pieces = 0;
  for (const FibreLine& line : straight_lines({0, M_PI / 2}, notched, kBox, {}))
    if (line.family == 0 && std::abs(line.first.y() - 70) < 1) ++pieces;
  EXPECT_EQ(pieces, 2);
}

TEST(FibreLines, WithoutAnOutlineHaveUnknownEnds) {
  for (const FibreLine& line : straight_lines({0, M_PI / 2}, {}, kBox, {})) EXPECT_FALSE(line.to_edge[0] || line.to_edge[1]);
}

// Fibres on circles round the origin, and along its rays.
AngleField round_field() {
  AngleField field(51, 51, {0, 0}, 2, Eigen::Vector2d::Zero());
  for (int j = 0; j < field.ny; ++j)
    for (int i = 0; i < field.nx; ++i) {
      const Eigen::Vector2d xy = field.position(i, j) + Eigen::Vector2d(100, 100);
      const double ray = std::atan2(xy.y(), xy.x());
      field.at(i, j) = {ray + M_PI / 2, ray};
    }
  return field;
}

TEST(FibreLines, FollowAFieldOfAngles) {
  FibreOptions options;
  const auto lines = field_lines(round_field(), kSquare, kBox, options);
  const Eigen::Vector2d centre(-100, -100);
  for (const FibreLine& line : lines) {
    ASSERT_GE(line.count, 2);
    for (int k = 1; k < line.count; ++k) EXPECT_NEAR((line.at(k) - line.at(k - 1)).norm(), options.step, 1e-4);
    if (line.family != 0) continue;
    const double radius = (line.at(0) - centre).norm();
    for (int k = 0; k < line.count; ++k) EXPECT_NEAR((line.at(k) - centre).norm(), radius, 0.02);
  }
  for (const int family : {0, 1}) EXPECT_GE(covered(lines, family, options.apart), 0.97e4);
  for (const int family : {0, 1}) EXPECT_LE(covered(lines, family, options.apart), 2e4);
}

TEST(FibreLines, AreStraightInAFieldOfEqualAngles) {
  for (const double degrees : {0.0, 30.0, 45.0, 89.999999, 90.0, 90.000001, 135.0, 180.0, -90.0, -135.0, 270.0, 725.0}) {
    const double angle = degrees * M_PI / 180;
    const AngleField field(11, 11, {0, 0}, 10.0, Eigen::Vector2d(angle, angle + M_PI / 3));
    for (const FibreLine& line : field_lines(field, kSquare, kBox, {})) {
      const double along = line.family == 0 ? angle : angle + M_PI / 3;
      EXPECT_NEAR(std::abs(line.way.dot(Eigen::Vector2d(std::cos(along), std::sin(along)))), 1, 1e-12);
      const Eigen::Vector2d whole = line.at(line.count - 1) - line.at(0);
      EXPECT_NEAR(std::abs(whole.dot(line.way)), line.length(), 1e-3) << degrees;
    }
  }
}

TEST(FibreLines, EndWhereNoAngleIsKnown) {
  AngleField field = round_field();
  for (int j = 0; j < field.ny; ++j)
    for (int i = 30; i < field.nx; ++i) field.at(i, j).setConstant(std::numeric_limits<double>::quiet_NaN());
  bool ends = false;
  for (const FibreLine& line : field_lines(field, kSquare, kBox, {})) {
    for (int k = 0; k < line.count; ++k) EXPECT_LT(line.at(k).x(), 61.0);
    ends = ends || !line.to_edge[1] || !line.to_edge[0];
  }
  EXPECT_TRUE(ends);
}

TEST(FibreLines, RefuseWhatIsNoLength) {
  FibreOptions options;
  options.apart = 0;
  EXPECT_THROW(straight_lines({0, 1}, kSquare, kBox, options), InputError);
  EXPECT_THROW(straight_lines({0, std::numeric_limits<double>::infinity()}, kSquare, kBox, {}), InputError);
}

}  // namespace
}  // namespace debulk::fibre_lines_test
