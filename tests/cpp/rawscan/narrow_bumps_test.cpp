// A bump that is narrow every way is found with the closed form of its height, width and length; what only looks like one is not.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "flat_scan.hpp"

namespace debulk {
namespace {

using namespace flat_scan;

const double kPi = std::acos(-1.0);
const NarrowBumpOptions kOptions;

// A squared cosine over an ellipse: at half its height it is half as wide and half as long as at its foot.
struct Bell {
  double x = 0, y = 0, wide = 0, long_ = 0, high = 0, turned = 0;
  double operator()(double at_x, double at_y) const {
    const double c = std::cos(turned), s = std::sin(turned), dx = at_x - x, dy = at_y - y;
    const double r = std::hypot((c * dx + s * dy) / long_, (c * dy - s * dx) / wide);
    return r < 0.5 ? high * std::pow(std::cos(kPi * r), 2) : 0.0;
  }
};

NarrowBumps found_in(const Shape& shape, double noise = 0.0) {
  const std::vector<float> scan = scan_of(shape, noise);
  return finder().find_bumps(view_of(scan), nullptr, kPitch);
}

TEST(NarrowBumps, HaveTheClosedFormsHeightOnceTheirTopIsASample) {
  for (const double wide : {6.0, 7.0, 10.0})  // none whose circle at half height runs through samples
    for (const double high : {1.5, 3.0, 6.0}) {
      SCOPED_TRACE(testing::Message() << wide << " mm wide, " << high << " mm high");
      const NarrowBumps found = found_in(Bell{0.25, -0.25, wide, wide, high});  // the middle of a pixel that is looked at
      ASSERT_EQ(found.bumps.size(), 1u);
      const NarrowBump& one = found.bumps[0];
      // The samples inside the circle at half height, counted; from one to the farthest across, and a sample further.
      int inside = 0;
      double farthest = 0;
      for (int j = -3; j <= 3; ++j)
        for (int i = -3; i <= 3; ++i)
          if (const double r = std::hypot(i, j); r < wide / 4 - 1e-9) ++inside, farthest = std::max(farthest, r);
      const double length = 2 * farthest + 1;
      EXPECT_NEAR(one.length, length, 1e-6);
      EXPECT_NEAR(one.width, 4 / kPi * inside / length, 1e-6);
      // The highest but one stands a sample beside the top; that is made good on average.
      const double measured = high * std::pow(std::cos(kPi / wide), 2);
      const double made_good = measured / std::pow(std::cos(kPi * std::min(0.25, 0.3 / one.width)), 2);
      EXPECT_NEAR(one.height, made_good, 0.01 * high);  // the camera sees a high point 1.2 % larger
    }
}

TEST(NarrowBumps, AreFoundWhereverTheyLieAndHoweverTheyAreTurned) {
  for (const Bell& bell : {Bell{41.3, 20.6, 6, 6, 2}, Bell{-70.2, 33.8, 9, 9, 3}, Bell{15.1, -60.4, 7, 18, 2, 0.6},
                           Bell{-33.7, -48.9, 8, 20, 3, 2.3}, Bell{80.9, -10.1, 6, 14, 6, kPi / 2}}) {
    SCOPED_TRACE(testing::Message() << bell.x << ", " << bell.y);
    const NarrowBumps found = found_in(bell, 0.03);
    EXPECT_FALSE(found.gave_up);
    ASSERT_EQ(found.bumps.size(), 1u);
    const NarrowBump& one = found.bumps[0];
    EXPECT_LT((one.top - Eigen::Vector2d(bell.x, bell.y)).norm(), 1.5);
    EXPECT_NEAR(one.height, bell.high, 0.15 * bell.high);
    EXPECT_NEAR(one.width, bell.wide / 2, 1.0);
    EXPECT_NEAR(one.length, bell.long_ / 2, 1.5);
  }
}

TEST(NarrowBumps, AreListedOnceEachHighestFirst) {
  const Bell low{-60, 10, 8, 8, 2}, high{50, -30, 8, 8, 4}, middle{20, 60, 8, 8, 3};
  const NarrowBumps found = found_in([&](double x, double y) { return low(x, y) + high(x, y) + middle(x, y); });
  ASSERT_EQ(found.bumps.size(), 3u);
  EXPECT_NEAR(found.bumps[0].top.x(), 50, 1.5);
  EXPECT_NEAR(found.bumps[1].top.x(), 20, 1.5);
  EXPECT_NEAR(found.bumps[2].top.x(), -60, 1.5);
}

TEST(NarrowBumps, AreHigherThanWhatTheyStandOn) {
  const Bell narrow{0, 0, 8, 8, 3}, wide{0, 0, 120, 120, 1.5};
  const NarrowBumps found = found_in([&](double x, double y) { return narrow(x, y) + wide(x, y); });
  ASSERT_EQ(found.bumps.size(), 1u);
  EXPECT_NEAR(found.bumps[0].height, 3, 0.45);
  const Bell pocket{0, 0, 120, 120, 6};  // of a bump on a pocket, the pocket decides
  EXPECT_TRUE(found_in([&](double x, double y) { return narrow(x, y) + pocket(x, y); }).bumps.empty());
}

TEST(NarrowBumps, AreNothingWideLowLongOrFlying) {
  EXPECT_TRUE(found_in(Bell{0, 0, 16, 16, 6}).bumps.empty());  // survives the filters
  EXPECT_TRUE(found_in(Bell{0, 0, 8, 8, 0.8 * kOptions.stands_out_mm}, 0.02).bumps.empty());
  EXPECT_TRUE(found_in(Bell{0, 0, 6, 60, 4, 0.4}).bumps.empty());  // a wrinkle, found as one
  EXPECT_TRUE(found_in([](double, double) { return 0.0; }, 0.1).bumps.empty());
  // Two and three flying pixels side by side, on the lines that are looked at.
  std::vector<float> flying = scan_of([](double, double) { return 0.0; });
  for (const int column : {100, 102, 300, 302, 304})
    flying[3 * (180 * static_cast<std::size_t>(kWidth) + static_cast<std::size_t>(column)) + 2] -= 5;
  EXPECT_TRUE(finder().find_bumps(view_of(flying), nullptr, kPitch).bumps.empty());
}

TEST(NarrowBumps, AreNotSeenInAHighlight) {
  const Bell bell{0, 0, 8, 8, 3};
  EXPECT_EQ(found_in(bell).bumps.size(), 1u);
  // Beside it, depths lie as far below the mold as the bell stands above it.
  const Shape wild = [&](double x, double y) {
    const bool below = std::hypot(x, y) > 3 && std::hypot(x, y) < 7 && static_cast<int>(std::floor(x) + std::floor(y)) % 2 == 0;
    return below ? -3.0 : bell(x, y);
  };
  EXPECT_TRUE(found_in(wild).bumps.empty());
}

TEST(NarrowBumps, AreNotLookedForWhereTheMaskOrTheMissingPlyHidesThem) {
  const std::vector<float> scan = scan_of(Bell{0, 0, 8, 8, 3});
  const std::vector<std::uint8_t> masked(static_cast<std::size_t>(kWidth) * kHeight, 1);
  EXPECT_TRUE(finder().find_bumps(view_of(scan), masked.data(), kPitch).bumps.empty());
  const Polygon elsewhere{{30, 30}, {80, 30}, {80, 80}, {30, 80}};
  EXPECT_TRUE(finder(elsewhere).find_bumps(view_of(scan), nullptr, kPitch).bumps.empty());
}

TEST(NarrowBumps, AreGivenUpAmongTooManyPointsThatStandOut) {
  const std::vector<float> wild = scan_of([](double, double) { return 0.0; }, 1.5);
  NarrowBumpOptions options;
  options.most = 100;
  const NarrowBumps found = finder().find_bumps(view_of(wild), nullptr, kPitch, options);
  EXPECT_TRUE(found.gave_up);
  EXPECT_TRUE(found.bumps.empty());
}

TEST(NarrowBumps, NeedAPitchAndHeedAStop) {
  const std::vector<float> scan = scan_of(Bell{0, 0, 8, 8, 3});
  EXPECT_THROW(finder().find_bumps(view_of(scan), nullptr, 0.0), InputError);
  const Stop stop;
  stop.cancel();
  EXPECT_THROW(finder().find_bumps(view_of(scan), nullptr, kPitch, {}, stop), Stopped);
}

}  // namespace
}  // namespace debulk
