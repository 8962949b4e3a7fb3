// The sections of the fibres over a trough that the ply spans on a circle: height, pull and hold in closed form.

#include "debulk/ridge/bridge_section.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace debulk {
namespace {

const double kPi = std::acos(-1.0);
constexpr double kHalf = 40, kMold = 150, kPly = 200;  // mm: of the trough, and the radii of mold and ply

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

// Heights of a ply over the trough, as far as the middle half of it; and what the scan adds.
FootMap scanned(double radius, const std::function<double(const Eigen::Vector2d&)>& off = nullptr) {
  FootMap feet;
  const int n = 401;
  feet.heights = Grid<float>(n, n, {-100, -100}, 0.5);
  feet.labels = Grid<std::int32_t>(n, n, {-100, -100}, 0.5);
  feet.mold_tol_mm = 0.2;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d xy = feet.heights.position(i, j);
      const double gap = std::abs(xy.x()) < kHalf ? (kHalf * kHalf - xy.x() * xy.x()) / 2 * (1 / kMold - 1 / radius) : 0;
      feet.heights.at(i, j) = static_cast<float>(feet.options.thickness_mm + gap + (off ? off(xy) : 0.0));
      feet.labels.at(i, j) = gap > 0.2 && std::abs(xy.y()) < 50 ? 1 : 0;
    }
  Foot foot;
  foot.label = 1;
  foot.outline = {{-kHalf, -50}, {kHalf, -50}, {kHalf, 50}, {-kHalf, 50}};
  feet.feet.push_back(foot);
  return feet;
}

// A ply whose edge is so far from the trough's banks, and twice as far to the right.
BridgeSectionOptions held(double way) {
  BridgeSectionOptions out;
  out.least_error = 0.02;
  out.ply = {{-kHalf - way, -500}, {kHalf + 2 * way, -500}, {kHalf + 2 * way, 500}, {-kHalf - way, 500}};
  out.mold_known = {{-2000, -2000}, {2000, 2000}};
  return out;
}

std::optional<BridgeSection> over(const FootMap& feet, const BridgeSectionOptions& options) {
  return bridge_section(feet, feet.feet[0], Trough(), {0, kPi / 2}, options);
}

TEST(BridgeSection, StandsAsItWasLaidWhereItIsHeld) {
  const auto out = over(scanned(kPly), held(580));
  ASSERT_TRUE(out);
  EXPECT_NEAR(out->lacks, arc(kMold) - arc(kPly), 0.02 * out->lacks);
  EXPECT_NEAR(out->gap, spanned(kPly), 0.02);
  EXPECT_NEAR(out->pull, 0.1 * kPly, 0.5);
  EXPECT_NEAR(out->hold, 0.04 * 580, 0.1);  // of the nearer end
  EXPECT_EQ(out->error, 0.02);
  EXPECT_NEAR(out->least_gap, spanned(radius_lacking(out->lacks - 0.02)), 0.01);
  EXPECT_NEAR(out->most_gap, spanned(radius_lacking(out->lacks + 0.02)), 0.01);
  EXPECT_LT(out->least_gap, out->gap - 0.02);
}

TEST(BridgeSection, SlipsUntilItPullsNoMoreThanIsHeld) {
  const auto slips = over(scanned(kPly), held(400));
  ASSERT_TRUE(slips);
  EXPECT_NEAR(slips->gap, spanned(160), 0.02);        // mu d, from where the ply is 0.03 mm off the mold
  EXPECT_NEAR(slips->least_gap, spanned(156), 0.02);  // of 10 mm less to hold it
  EXPECT_NEAR(slips->most_gap, spanned(164), 0.02);
  EXPECT_NEAR(slips->pull, 0.1 * kPly, 0.5);
  const auto drawn_in = over(scanned(kPly), held(350));  // 140 mm, less than the mold's radius
  ASSERT_TRUE(drawn_in);
  EXPECT_EQ(drawn_in->most_gap, 0);
  EXPECT_NEAR(drawn_in->hold, 14.0, 0.1);
  EXPECT_GT(drawn_in->lacks, 0.4);
}

TEST(BridgeSection, IsAsUncertainAsThePlyScattersWhereItLies) {
  const auto ripple = [](double height) {
    return [height](const Eigen::Vector2d& xy) { return std::abs(xy.x()) > kHalf + 2 ? height * std::sin(xy.x() / 3) : 0.0; };
  };
  const auto little = over(scanned(kPly, ripple(0.01)), held(580)), more = over(scanned(kPly, ripple(0.07)), held(580)),
             much = over(scanned(kPly, ripple(0.1)), held(580));
  ASSERT_TRUE(little && more && much);
  // Of a ply with the squared curvature 1 / R^2 along what stands off the mold, and more where it bends at the banks.
  const double expected = 2 * 0.1 / std::sqrt(2.0) * std::sqrt(20 * 2 * kHalf) / kPly;
  EXPECT_GT(much->error, expected);
  EXPECT_LT(much->error, 1.7 * expected);
  EXPECT_NEAR(more->error, 0.7 * much->error, 1e-3 * much->error);
  EXPECT_EQ(little->error, 0.02);
  EXPECT_LT(much->least_gap, more->least_gap);
  EXPECT_GT(much->most_gap, more->most_gap);
}

TEST(BridgeSection, IsNoneWhereNoFibreIsTooShort) {
  const auto longer = over(scanned(-60), held(580));  // bulges upward
  ASSERT_TRUE(longer);
  EXPECT_EQ(longer->lacks, 0);
  EXPECT_EQ(longer->most_gap, 0);
}

TEST(BridgeSection, IsHeldAsFarAsTheMoldReachesIfTheOutlineIsNotKnown) {
  BridgeSectionOptions no_outline = held(580);
  no_outline.ply.clear();
  const auto out = over(scanned(kPly), no_outline);
  ASSERT_TRUE(out);
  EXPECT_NEAR(out->hold, 0.04 * (2000 - kHalf), 0.1);
}

TEST(BridgeSection, IsNotKnownWithoutTheMold) {
  BridgeSectionOptions mold_ends = held(580);
  mold_ends.mold_known = {{-30, -2000}, {2000, 2000}};  // under the pocket
  EXPECT_FALSE(over(scanned(kPly), mold_ends));
  mold_ends.mold_known = {{-60, -2000}, {2000, 2000}};  // beyond it
  EXPECT_TRUE(over(scanned(kPly), mold_ends));
}

}  // namespace
}  // namespace debulk
