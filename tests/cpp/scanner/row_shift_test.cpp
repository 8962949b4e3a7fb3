#include "debulk/scanner/row_shift.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

#include <gtest/gtest.h>

namespace debulk::row_shift_test {
namespace {

constexpr int width = 160, height = 140;
constexpr float disparity = 9.5f, none = std::numeric_limits<float>::quiet_NaN();

double texture(double x, double y) {
  return 40 * std::exp(0.3 * std::sin(0.5 * x + 0.2 * y) + 0.2 * std::cos(0.45 * y - 0.3 * x));
}

// A plane of one depth, whose points lie `down` rows lower in the right image. The right image is taken twice as bright.
struct Cameras {
  std::vector<float> points, light[2], column, row;
  std::vector<std::uint8_t> exposure;
  RowMatches matches;
  SeenTexture seen[2];

  explicit Cameras(double down) : exposure(std::size_t{width} * height, 0) {
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i) {
        points.insert(points.end(), {0, 0, 2000 / (disparity + 3)}), column.push_back(static_cast<float>(i)),
            row.push_back(static_cast<float>(j));
        light[0].push_back(static_cast<float>(texture(i, j))), light[1].push_back(static_cast<float>(2 * texture(i + disparity, j - down)));
      }
    matches = {points.data(), width, height, 2000, 3};
    for (std::size_t k = 0; k < 2; ++k)
      seen[k] = {light[k].data(), exposure.data(), {1, 4}, width, height, column.data(), row.data(), width};
  }
  std::vector<RowShift> look(int step, int threads = 1, std::vector<PatchPlace> places = {{70, 60}, {90, 70}}) const {
    return row_shifts(places, step, matches, seen[0], seen[1], threads, Stop());
  }
};

TEST(RowShift, WholeRowsAreFoundExactly) {
  for (const int down : {-5, -1, 0, 3, 5})
    for (const RowShift& one : Cameras(down).look(1)) {
      EXPECT_TRUE(one.textured);
      EXPECT_GT(one.correlation, 0.999);  // the columns are interpolated half way
      EXPECT_NEAR(one.rows, down, 0.02);
    }
}

TEST(RowShift, FractionsOfARowAreInterpolated) {
  for (const double down : {-1.6, 0.3, 2.5})
    for (const RowShift& one : Cameras(down).look(1)) EXPECT_NEAR(one.rows, down, 0.1);
}

TEST(RowShift, EveryOtherPixelIsEnough) {
  for (const RowShift& one : Cameras(4).look(2)) EXPECT_NEAR(one.rows, 4, 0.05);
}

// The right image's rectification may be wider than the left one's, and have its columns at other places.
TEST(RowShift, TheRectifiedImagesNeedNotBeAlikeWide) {
  constexpr int wide = width + 30;
  Cameras cameras(2);
  std::vector<float> column, row;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < wide; ++i) column.push_back(static_cast<float>(i - 20)), row.push_back(static_cast<float>(j));
  cameras.seen[1].map_x = column.data(), cameras.seen[1].map_y = row.data(), cameras.seen[1].rectified_width = wide;
  cameras.matches.shift += 20;
  const auto found = cameras.look(1);
  EXPECT_NEAR(found[0].rows, 2, 0.02);
  EXPECT_GT(found[0].correlation, 0.999);
}

TEST(RowShift, BeyondItsReachNothingAgrees) {
  for (const RowShift& one : Cameras(6).look(1)) EXPECT_EQ(one.correlation, 0);
}

TEST(RowShift, ALongerExposureIsNoTexture) {
  Cameras cameras(2);
  const RowShift before = cameras.look(1)[0];
  for (std::size_t k = 0; k < cameras.exposure.size(); ++k)
    if (k / width > 61) cameras.exposure[k] = 7, cameras.light[0][k] *= 4, cameras.light[1][k] *= 4;  // the last one there is
  const RowShift after = cameras.look(1)[0];
  EXPECT_EQ(after.correlation, before.correlation);
  EXPECT_EQ(after.rows, before.rows);
}

TEST(RowShift, APatchNeedsTextureAndPoints) {
  Cameras plain(0);
  for (std::size_t k = 0; k < plain.light[0].size(); ++k)  // slopes of the logarithm alone
    plain.light[0][k] = static_cast<float>(30 * std::exp(0.01 * static_cast<double>(k / width) - 0.02 * static_cast<double>(k % width)));
  for (const RowShift& one : plain.look(1)) EXPECT_FALSE(one.textured);
  Cameras dark(0);
  dark.light[0][60 * width + 70] = none;
  EXPECT_FALSE(dark.look(1)[0].textured);
  Cameras gaps(1);
  for (std::size_t k = 0; k < gaps.points.size(); k += 3 * 11) gaps.points[k + 2] = none;  // the median stands in
  EXPECT_NEAR(gaps.look(1)[0].rows, 1, 0.02);
  for (std::size_t k = 0; k < gaps.points.size(); k += 3 * 9) gaps.points[k + 2] = none;
  EXPECT_FALSE(gaps.look(1)[0].textured);
}

TEST(RowShift, WhatTheRightImageDoesNotShowDoesNotAgree) {
  Cameras cameras(0);
  for (std::size_t k = 2; k < cameras.points.size(); k += 3) cameras.points[k] = 2000.0f / (80 + 3);  // left of the image
  const RowShift one = cameras.look(1)[0];
  EXPECT_TRUE(one.textured);
  EXPECT_EQ(one.correlation, 0);
}

TEST(RowShift, PlacesAtTheEdgeHaveNoPatchAndThreadsGiveTheSameBits) {
  const Cameras cameras(-2.3);
  const std::vector<PatchPlace> places = {{11, 60}, {12, 60}, {70, 11}, {width - 12, 60}, {60, height - 12}, {100, 80}, {75, 64}};
  const auto one = cameras.look(1, 1, places), many = cameras.look(1, 4, places);
  for (std::size_t k : {0u, 2u, 3u, 4u}) EXPECT_FALSE(one[k].textured);
  EXPECT_TRUE(one[1].textured);
  for (std::size_t k = 0; k < places.size(); ++k) {
    EXPECT_EQ(one[k].textured, many[k].textured);
    EXPECT_EQ(one[k].correlation, many[k].correlation);
    EXPECT_EQ(one[k].rows, many[k].rows);
  }
}

}  // namespace
}  // namespace debulk::row_shift_test
