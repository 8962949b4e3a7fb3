#include "debulk/cloud/fourth_differences.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clouds.hpp"

namespace debulk {
namespace {

using namespace testing;

PointImage image(const Cloud& cloud) {
  return {cloud.xyz.data(), 3 * cloud.width, cloud.width, cloud.height};
}

TEST(FourthDifferences, AreThoseOfAPolynomialAlongItsAxis) {
  const Cloud cloud = make(12, 9, [](int i, int j, float* p) {
    p[0] = static_cast<float>(i * i * i), p[1] = static_cast<float>(j), p[2] = static_cast<float>(i * i * i * i - 2 * j * j * j * j);
  });
  const std::vector<std::array<float, 3>> axes{{0, 0, 1}, {1, 1, 0}};
  const PixelDifferences out = fourth_differences(image(cloud), image(cloud), 3, axes, 2);
  ASSERT_EQ(out.rows, 2);
  ASSERT_EQ(out.columns, 3);
  // f(2) + f(-2) - 4 (f(1) + f(-1)) + 6 f(0) of x⁴ is 24; without the last term, of differences, it is the same.
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(out.apart[k], 48);
    EXPECT_EQ(out.apart[6 + k], 24);
    EXPECT_EQ(out.apart[12 + k], 0);
    EXPECT_EQ(out.apart[18 + k], 0);
  }
}

TEST(FourthDifferences, AreUnknownBesideWhatWasNotSeenAndTellCopies) {
  Cloud cloud = make(9, 9, [](int i, int j, float* p) {
    p[0] = static_cast<float>(i), p[1] = static_cast<float>(j), p[2] = static_cast<float>(10 * i + j * j);
  });
  cloud.point(4, 2)[2] = nan;                   // beside the pixel (2, 2), in its row
  cloud.point(7, 7)[2] = cloud.point(6, 6)[2];  // aslant of the pixel (6, 6)
  const PixelDifferences out = fourth_differences(image(cloud), image(cloud), 4, {{0, 0, 1}});
  ASSERT_EQ(out.rows, 2);
  ASSERT_EQ(out.columns, 2);
  EXPECT_FALSE(std::isnan(out.apart[0]));
  EXPECT_TRUE(std::isnan(out.apart[4]));
  EXPECT_EQ(out.copied, (std::vector<std::uint8_t>{0, 0, 0, 1}));
}

TEST(FourthDifferences, OfAPartAreThoseOfTheWholeOnAnyNumberOfThreads) {
  const Cloud cloud = sheet(101, 67, 3);
  const std::vector<std::array<float, 3>> axes{{0, 0, 1}, {0.1f, -0.2f, 0.97f}};
  const PixelDifferences one = fourth_differences(image(cloud), image(cloud), 1, axes, 1);
  const PointImage part{cloud.xyz.data() + 3 * (5 * 101 + 7), 3 * 101, 60, 40};
  for (const int threads : {1, 3}) {
    const PixelDifferences out = fourth_differences(part, part, 1, axes, threads);
    ASSERT_EQ(out.rows, 36);
    ASSERT_EQ(out.columns, 56);
    for (int r = 0; r < 36; ++r)
      for (int c = 0; c < 56; ++c) {
        const auto here = static_cast<std::size_t>(r * 56 + c), there = static_cast<std::size_t>((r + 5) * 97 + c + 7);
        EXPECT_EQ(out.copied[here], one.copied[there]);
        for (std::size_t way = 0; way < 4; ++way) {
          const float a = out.apart[way * 36 * 56 + here], b = one.apart[way * 63 * 97 + there];
          EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b)));
        }
      }
  }
}

TEST(FourthDifferences, OfTooSmallAnImageAreNone) {
  const Cloud cloud = sheet(4, 30, 1);
  const PixelDifferences out = fourth_differences(image(cloud), image(cloud), 1, {{0, 0, 1}});
  EXPECT_EQ(out.rows, 26);
  EXPECT_EQ(out.columns, 0);
}

}  // namespace
}  // namespace debulk
