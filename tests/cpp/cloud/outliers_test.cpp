#include "debulk/cloud/outliers.hpp"

#include <gtest/gtest.h>

#include "clouds.hpp"
#include "debulk/cloud/neighbours.hpp"
#include "debulk/core/error.hpp"

namespace debulk {
namespace {

using namespace testing;

// Nine points in a row, one apart, and one at 20: worked out by hand.
TEST(Outliers, AreThoseAboveMeanPlusSampleDeviation) {
  Cloud cloud = make(10, 1, [](int i, int, float* p) { p[0] = static_cast<float>(i < 9 ? i : 20), p[1] = p[2] = 0; });
  OutlierOptions options;
  options.neighbours = 1;
  options.std_ratio = 2.8;  // (12 - 2.1) is 2.846 sample and 3.0 population deviations above the mean
  const Outliers found = remove_outliers(cloud.view(), options);
  EXPECT_DOUBLE_EQ(found.mean, (9 * 1 + 12) / 10.0);
  EXPECT_NEAR(found.deviation, std::sqrt((9 * 1.1 * 1.1 + 9.9 * 9.9) / 9), 1e-12);
  EXPECT_EQ(found.removed, 1);
  EXPECT_EQ(found.keep.back(), 0);
  options.std_ratio = 2.85;
  EXPECT_EQ(remove_outliers(cloud.view(), options).removed, 0);
}

TEST(Outliers, HaveTheSameBitsOnAnyNumberOfThreads) {
  const Cloud cloud = sheet(400, 300, 23);
  const Outliers one = remove_outliers(cloud.view(), {}, 1);
  for (const int threads : {2, 4})
    for (const CloudView& view : {cloud.view(), cloud.flat()}) {
      const Outliers other = remove_outliers(view, {}, threads);
      EXPECT_EQ(one.keep, other.keep);
      EXPECT_EQ(one.mean, other.mean);
      EXPECT_EQ(one.deviation, other.deviation);
    }
  EXPECT_GT(one.removed, one.seen / 1000);
  EXPECT_LT(one.removed, one.seen / 10);
}

TEST(Outliers, CatchFlyingPixels) {
  Cloud cloud =
      make(100, 80, [](int i, int j, float* p) { p[0] = 0.5f * static_cast<float>(i), p[1] = 0.5f * static_cast<float>(j), p[2] = 0; });
  for (int k = 5; k < 75; k += 7) cloud.point(k, k)[2] = 4;
  cloud.point(50, 3)[1] = nan;
  const Outliers found = remove_outliers(cloud.view());
  EXPECT_EQ(found.removed, 10 + 4);  // the corners' neighbours are farther, too
  for (int k = 5; k < 75; k += 7) EXPECT_EQ(found.keep[static_cast<std::size_t>(k * 100 + k)], 0);
  EXPECT_EQ(found.keep[350], 0);
  EXPECT_EQ(found.seen, 7999);
}

TEST(Outliers, OfDegenerateCloudsAreNone) {
  EXPECT_EQ(remove_outliers(Cloud{}.view()).keep.size(), 0u);
  const Cloud nothing = make(3, 3, [](int, int, float* p) { p[0] = p[1] = p[2] = nan; });
  EXPECT_EQ(remove_outliers(nothing.view()).keep, std::vector<std::uint8_t>(9, 0));
  const Cloud alone = make(3, 3, [](int i, int j, float* p) { p[0] = p[1] = p[2] = i + j == 0 ? 1 : nan; });
  EXPECT_EQ(remove_outliers(alone.view()).keep[0], 1);
  const Cloud copies = make(30, 30, [](int, int, float* p) { p[0] = p[1] = p[2] = 1; });
  EXPECT_EQ(remove_outliers(copies.view()).removed, 0);
}

// Without flying pixels the deviation is next to nothing, and one deviation above the mean is on any slope.
TEST(Outliers, SpareTheFlanksOfACleanScanOnRequest) {
  const Cloud cloud = make(100, 80, [](int i, int j, float* p) {
    p[0] = 0.5f * static_cast<float>(i), p[1] = 0.5f * static_cast<float>(j), p[2] = 0.6f * std::max(0.0f, 4 - std::abs(p[0] - 25));
  });
  EXPECT_GT(remove_outliers(cloud.view()).removed, 1000);
  EXPECT_EQ(remove_outliers(cloud.view(), {4, 1.0, 2.0}).removed, 0);
}

TEST(Outliers, RefuseBadOptions) {
  const Cloud cloud = sheet(5, 5, 1);
  EXPECT_THROW(remove_outliers(cloud.view(), {0, 1.0, 0.0}), InputError);
  EXPECT_THROW(remove_outliers(cloud.view(), {4, -1.0, 0.0}), InputError);
  EXPECT_THROW(remove_outliers(cloud.view(), {4, nan, 0.0}), InputError);
  EXPECT_THROW(remove_outliers(cloud.view(), {4, 1.0, -1.0}), InputError);
}

}  // namespace
}  // namespace debulk
