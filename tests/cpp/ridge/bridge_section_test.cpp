// Fibres over a trough that the ply spans on a circle: height, pull and hold in closed form.

#include "debulk/ridge/bridge_section.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace debulk::bridge_section_test {
namespace {

constexpr double kHalf = 40, kMold = 150, kPly = 200, kError = 0.02;  // mm: of the trough, the radii of mold and ply, of the length

// A round trough along y between flat banks.
struct Trough : Surface {
  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    SurfaceSample s;
    s.height = std::min(xy.x() * xy.x(), kHalf * kHalf) / (2 * kMold);
    return s;
  }
};

double spanned(double radius) {
  return kHalf * kHalf / 2 * (1 / kMold - 1 / radius);
}
double arc(double radius) {
  return kHalf * std::sqrt(1 + kHalf * kHalf / radius / radius) + radius * std::asinh(kHalf / radius);
}
double radius_lacking(double lacks) {
  double low = kMold, high = 1e6;
  for (int k = 0; k < 100; ++k) (arc(kMold) - arc(0.5 * (low + high)) < lacks ? low : high) = 0.5 * (low + high);
  return low;
}

ShortFibre across(double y, double radius) {
  const double lacks = arc(kMold) - arc(radius);
  return {{-kHalf, y}, {kHalf, y}, lacks, kError, lacks + kError};
}

// A ply whose edge is so far from the trough's banks, and twice as far to the right.
BridgeSectionOptions held(double way) {
  BridgeSectionOptions out;
  out.ply = {{-kHalf - way, -500}, {kHalf + 2 * way, -500}, {kHalf + 2 * way, 500}, {-kHalf - way, 500}};
  out.mold_known = {{-2000, -2000}, {2000, 2000}};
  return out;
}

BridgeSection over(const std::vector<ShortFibre>& fibres, const BridgeSectionOptions& options) {
  return bridge_section(fibres, Trough(), options);
}

TEST(BridgeSection, StandsAsItWasLaidWhereItIsHeld) {
  const BridgeSection out = over({across(0, kPly)}, held(580));
  const double lacks = arc(kMold) - arc(kPly);
  EXPECT_EQ(out.lacks, lacks);
  EXPECT_EQ(out.error, kError);
  EXPECT_NEAR(out.gap, spanned(kPly), 0.01);
  EXPECT_NEAR(out.pull, 0.1 * kPly, 0.5);
  EXPECT_NEAR(out.hold, 0.04 * 580, 1e-9);  // of the nearer end
  EXPECT_NEAR(out.least_gap, spanned(radius_lacking(lacks - kError)), 0.01);
  EXPECT_NEAR(out.most_gap, spanned(radius_lacking(lacks + kError)), 0.01);
}

TEST(BridgeSection, SlipsUntilItPullsNoMoreThanIsHeld) {
  const BridgeSection slips = over({across(0, kPly)}, held(400));
  EXPECT_NEAR(slips.gap, spanned(160), 0.01);        // mu d
  EXPECT_NEAR(slips.least_gap, spanned(156), 0.01);  // of 10 mm less to hold it
  EXPECT_NEAR(slips.most_gap, spanned(164), 0.01);
  EXPECT_NEAR(slips.pull, 0.1 * kPly, 0.5);
  const BridgeSection drawn_in = over({across(0, kPly)}, held(350));  // 140 mm, less than the mold's radius
  EXPECT_EQ(drawn_in.most_gap, 0);
  EXPECT_NEAR(drawn_in.hold, 14.0, 1e-9);
  EXPECT_GT(drawn_in.lacks, 0.4);
}

TEST(BridgeSection, IsThatOfTheHighestFibreWhateverTheirOrder) {
  const ShortFibre low = across(-10, 165), high = across(10, kPly);
  for (const auto& fibres : {std::vector{low, high}, std::vector{high, low}}) EXPECT_NEAR(over(fibres, held(580)).gap, spanned(kPly), 0.01);
  ShortFibre unsure = low;
  unsure.most = 0.9;
  EXPECT_GT(over({unsure, high}, held(580)).most_gap, over({high}, held(580)).most_gap + 0.1);  // what any may have at most
  EXPECT_NEAR(over({unsure, high}, held(580)).gap, spanned(kPly), 0.01);
}

TEST(BridgeSection, IsNoneWhereNoFibreIsTooShort) {
  const BridgeSection longer = over({{{-kHalf, 0}, {kHalf, 0}, -0.5, kError, 0.3}}, held(580));
  EXPECT_EQ(longer.lacks, 0);
  EXPECT_EQ(longer.most_gap, 0);
}

TEST(BridgeSection, IsNotSureWhereItIsShorterThanTheFiltersResolve) {
  const BridgeSection narrow = over({{{-3, 0}, {3, 0}, arc(kMold) - arc(kPly), kError}}, held(580));
  EXPECT_EQ(narrow.least_gap, 0);
  EXPECT_GT(narrow.gap, 0.5);
}

TEST(BridgeSection, IsHeldAsFarAsTheMoldReachesIfTheOutlineIsNotKnown) {
  BridgeSectionOptions no_outline = held(580);
  no_outline.ply.clear();
  EXPECT_NEAR(over({across(0, kPly)}, no_outline).hold, 0.04 * (2000 - kHalf), 1e-9);
}

TEST(BridgeSection, ReadsTheMoldOnlyWhereItIsKnown) {
  struct Known : Trough {
    SurfaceSample sample(const Eigen::Vector2d& xy) const override {
      EXPECT_GE(xy.x(), -30.0);
      return Trough::sample(xy);
    }
  };
  BridgeSectionOptions mold_ends = held(580);
  mold_ends.mold_known = {{-30, -2000}, {2000, 2000}};
  EXPECT_GT(bridge_section({{{-20, 0}, {20, 0}, 0.3, kError, 0.32}}, Known(), mold_ends).gap, 0.5);
}

}  // namespace
}  // namespace debulk::bridge_section_test
