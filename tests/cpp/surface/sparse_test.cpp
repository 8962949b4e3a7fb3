#include "debulk/surface/sparse.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "debulk/surface/height_map.hpp"
#include "scene.hpp"

namespace debulk {
namespace {

using namespace testing;

constexpr int kSide = 150;  // pixels, 1 mm apart; more rows than a thread takes at once

// A level image, of whose pixels those within `radius` of its middle are seen at random with this share.
std::vector<float> image(double radius, double share) {
  Noise noise(7);
  std::vector<float> out;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const bool lost = std::hypot(i - 75.0, j - 75.0) < radius && noise.uniform() >= share;
      for (const float v : {static_cast<float>(i), static_cast<float>(j), 0.3F}) out.push_back(lost ? nanf : v);
    }
  return out;
}

CloudView view(const std::vector<float>& xyz) {
  return {xyz.data(), kSide, kSide};
}

TEST(Sparse, NamesEveryPixelRoundWhichLessThanAThirdIsSeen) {
  const std::vector<float> xyz = image(20, 0.25);
  const CloudView cloud = view(xyz);
  std::vector<Eigen::Vector2f> expected;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      int seen = 0, all = 0;
      for (int b = std::max(0, j - 2); b <= std::min(kSide - 1, j + 2); ++b)
        for (int a = std::max(0, i - 2); a <= std::min(kSide - 1, i + 2); ++a, ++all)
          seen += cloud.seen(static_cast<std::size_t>(b) * kSide + a);
      if (3 * seen < all && cloud.seen(static_cast<std::size_t>(j) * kSide + i)) expected.emplace_back(i, j);
    }
  ASSERT_GT(expected.size(), 100u);
  for (const int threads : {1, 4}) EXPECT_EQ(sparse_places(cloud, threads), expected);
}

TEST(Sparse, IsNoScanThatLosesHalfOfItsPixelsAtRandom) {
  const std::vector<float> xyz = image(1000, 0.5);
  EXPECT_LT(sparse_places(view(xyz)).size(), 0.05 * kSide * kSide);
  EXPECT_TRUE(sparse_places(view(image(0, 1))).empty());
}

TEST(Sparse, ClearsWhatIsNear) {
  Grid<std::uint8_t> marks(10, 10, {0, 0}, 2.0, 1);
  clear_round({{4.5F, 4.5F}, {-100, 3}, {0, 18.9F}}, 3.0, marks);
  EXPECT_EQ(std::count(marks.values.begin(), marks.values.end(), 0), 9 + 4);
  EXPECT_EQ(marks.at(1, 1), 0);
  EXPECT_EQ(marks.at(3, 3), 0);
  EXPECT_EQ(marks.at(4, 3), 1);
  EXPECT_EQ(marks.at(0, 9), 0);
  EXPECT_EQ(marks.at(1, 8), 0);
}

TEST(Sparse, HeightsThatRestOnFewPixelsAreNotMeasured) {
  const std::vector<float> scan = image(20, 0.2), below = image(0, 1);
  HeightMapOptions options;
  options.spacing = 1.0;
  const HeightMap map = height_map(view(scan), view(below), options);
  int known = 0, measured = 0;
  for (int j = 65; j < 86; ++j)
    for (int i = 65; i < 86; ++i) known += std::isfinite(map.heights.at(i, j)), measured += map.measured.at(i, j);
  EXPECT_GT(known, 60);
  EXPECT_LT(measured, 0.25 * known);
}

}  // namespace
}  // namespace debulk
