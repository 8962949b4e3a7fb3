// Pockets measured on a smooth surface (smooth_outline.hpp), through segment().

#include "debulk/pocket/smooth_outline.hpp"

#include <gtest/gtest.h>

#include "bells.hpp"
#include "debulk/core/error.hpp"
#include "debulk/pocket/segment.hpp"

namespace debulk::smooth_outline_test {
namespace {

SegmentOptions smoothing(double blur_mm2 = 0) {
  SegmentOptions options;
  options.smooth_mm = 8, options.blur_mm2 = blur_mm2;
  return options;
}

// The mean of the three by three heights round each: a blur of variance 2/3 spacing².
Grid<float> blurred(const Grid<float>& heights) {
  Grid<float> out = heights;
  for (int j = 1; j + 1 < heights.ny; ++j)
    for (int i = 1; i + 1 < heights.nx; ++i) {
      double sum = 0;
      for (int b = -1; b <= 1; ++b)
        for (int a = -1; a <= 1; ++a) sum += heights.at(i + a, j + b);
      out.at(i, j) = static_cast<float>(sum / 9);
    }
  return out;
}

void expect_bell(const Pocket& p, const Bell& bell, double relative, double peak_mm) {
  EXPECT_NEAR(p.area / bell.area(2.0), 1, relative);
  EXPECT_NEAR(p.volume / bell.volume(2.0), 1, relative);
  EXPECT_NEAR(p.peak, bell.height, peak_mm);
}

TEST(SmoothOutline, UndoesTheBlurOfTheHeights) {
  for (const double spacing : {0.5, 1.0})
    for (const Bell& bell : {Bell{{60.3, 55.7}, 8, 40, 40}, Bell{{60.1, 50.4}, 4, 26, 26}, Bell{{60.2, 60.9}, 6, 50, 24, 0.4}}) {
      const auto heights = blurred(sampled_bells({bell}, static_cast<int>(130 / spacing), static_cast<int>(120 / spacing), spacing));
      const double blur = 2.0 / 3 * spacing * spacing;
      const Pocket undone = segment(heights, smoothing(blur)).pockets.at(0);
      expect_bell(undone, bell, 1e-3, 0.004);
      const Pocket given = segment(heights, {}).pockets.at(0);
      EXPECT_GT(bell.height - given.peak, 0.6 * blur / 2 * kPi * kPi * bell.height / (bell.a * bell.a));
    }
}

TEST(SmoothOutline, MeasuresOnTheHeightsBeforeAMedianIfItGetsThem) {
  const Bell bell{{60.3, 55.7}, 8, 40, 40};
  const auto heights = sampled_bells({bell}, 121, 121, 1.0);
  auto low = heights;
  for (float& h : low.values) h *= 0.9F;
  const Pocket before = segment(low, smoothing(), nullptr, &heights).pockets.at(0);
  expect_bell(before, bell, 1e-3, 0.004);
  EXPECT_LT(segment(low, smoothing()).pockets.at(0).volume, 0.95 * before.volume);
  const Grid<float> none, other(3, 3, {0, 0}, 1.0);
  EXPECT_EQ(segment(low, smoothing(), nullptr, &none).pockets.at(0).volume, segment(low, smoothing()).pockets.at(0).volume);
  EXPECT_THROW(segment(low, smoothing(), nullptr, &other), InputError);
}

TEST(SmoothOutline, NoiseNeitherLiftsThePeakNorShakesTheOutline) {
  const Bell bell{{60.3, 60.7}, 4, 40, 40};  // flat on top: many heights compete for the highest
  double peak = 0, raw_peak = 0, area = 0, raw_area = 0;
  constexpr unsigned long rounds = 24;
  for (unsigned long n = 0; n < rounds; ++n) {
    auto heights = sampled_bells({bell}, 240, 240, 0.5);
    for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] += static_cast<float>(0.08 * noise(n * heights.size() + k));
    const Pocket p = segment(heights, smoothing()).pockets.at(0), raw = segment(heights, {}).pockets.at(0);
    peak += p.peak - 4, raw_peak += raw.peak - 4;
    area += std::pow(p.area / bell.area(2.0) - 1, 2), raw_area += std::pow(raw.area / bell.area(2.0) - 1, 2);
  }
  EXPECT_LT(std::abs(peak / rounds), 0.015);
  EXPECT_GT(raw_peak / rounds, 0.15);
  EXPECT_LT(std::sqrt(area / rounds), 1.5e-3);
  EXPECT_LT(area, 0.5 * raw_area);
}

TEST(SmoothOutline, LooksAtThePlysEdgeFromTheSide) {
  const Bell bell{{70.3, 60.7}, 6, 50, 40};
  for (const double edge : {70.3, 78.8, 64.1, 87.6}) {
    auto options = smoothing();
    options.ply_outline = Polygon{{-50, -50}, {edge, -50}, {edge, 300}, {-50, 300}};
    const auto heights = sampled_bells({bell}, 141, 121, 1.0);
    auto seen = heights;  // beyond the edge lies the mold, and the pixels next to the edge see much of it
    for (int j = 0; j < seen.ny; ++j)
      for (int i = 0; i < seen.nx; ++i) {
        const double beyond = seen.position(i, j).x() - edge;
        seen.at(i, j) *= static_cast<float>(beyond > 0 ? 0 : beyond > -1 ? 0.2 : 1);
      }
    const auto exact = segment(heights, options), found = segment(seen, options);
    ASSERT_EQ(found.pockets.size(), 1u);
    EXPECT_TRUE(found.pockets[0].touches_ply_edge);
    EXPECT_FALSE(found.pockets[0].touches_unknown);
    EXPECT_NEAR(found.pockets[0].area / exact.pockets.at(0).area, 1, 1e-6);  // it did not look there
    EXPECT_NEAR(found.pockets[0].peak, exact.pockets.at(0).peak, 1e-4);
    options.smooth_mm = 0;
    EXPECT_NEAR(exact.pockets[0].area / segment(heights, options).pockets.at(0).area, 1, 2e-3);
    EXPECT_LT(segment(seen, options).pockets.at(0).area, 0.995 * exact.pockets[0].area);
  }
}

TEST(SmoothOutline, ANarrowPocketIsNotSmoothedAway) {
  for (const double angle : {0.0, 0.3, 0.8}) {
    const Bell ridge{{60.2, 60.7}, 6, 110, 3.3, angle};  // 4 mm wide at the cut
    const Segmentation s = segment(sampled_bells({ridge}, 260, 260, 0.5), smoothing());
    ASSERT_EQ(s.pockets.size(), 1u);
    EXPECT_NEAR(s.pockets[0].peak, 6, 0.25);
    const Pocket given = segment(sampled_bells({ridge}, 260, 260, 0.5), {}).pockets.at(0);
    EXPECT_NEAR(s.pockets[0].area / given.area, 1, 0.02);
    EXPECT_NEAR(s.pockets[0].volume / given.volume, 1, 0.02);
  }
}

TEST(SmoothOutline, NeighboursStayApart) {
  // Two bells whose contours at the cut come within 1.3 mm of each other, in noise.
  const Bell a{{50, 60}, 8, 40, 40}, b{{50 + 2 * 40 * 2.0 / 3 + 1.3, 60}, 8, 40, 40};
  auto heights = sampled_bells({a, b}, 180, 120, 1.0);
  for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] += static_cast<float>(0.03 * noise(k));
  const Segmentation s = segment(heights, smoothing());
  ASSERT_EQ(s.pockets.size(), 2u);
  for (const Pocket& p : s.pockets) EXPECT_NEAR(p.area / a.area(2.0), 1, 4e-3);
  for (const Eigen::Vector2d& p : s.pockets[0].outline) EXPECT_FALSE(inside(s.pockets[1].outline, p));
}

TEST(SmoothOutline, UnknownHeightsStayUnknown) {
  const Bell bell{{60, 60}, 8, 40, 40};
  auto heights = sampled_bells({bell}, 121, 121, 1.0);
  drop_disc(heights, {86, 60}, 12.0);
  const Segmentation open = segment(heights, smoothing()), given = segment(heights, {});
  EXPECT_TRUE(open.pockets.at(0).touches_unknown);
  EXPECT_NEAR(open.pockets[0].area / given.pockets.at(0).area, 1, 0.02);
}

TEST(SmoothOutline, APartOfTheMapTellsTheSameBits) {
  for (const double spacing : {0.375, 0.5, 1.0}) {
    const Bell bell{{60.3, 55.7}, 5, 26, 22, 0.3};
    auto heights = sampled_bells({bell}, static_cast<int>(140 / spacing), static_cast<int>(140 / spacing), spacing);
    for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] += static_cast<float>(0.05 * noise(k));
    const int i0 = static_cast<int>(17 / spacing), j0 = static_cast<int>(20 / spacing) + 1;
    Grid<float> part(static_cast<int>(90 / spacing), static_cast<int>(75 / spacing), heights.position(i0, j0), spacing);
    for (int j = 0; j < part.ny; ++j)
      for (int i = 0; i < part.nx; ++i) part.at(i, j) = heights.at(i + i0, j + j0);
    const Pocket a = segment(heights, smoothing(0.1)).pockets.at(0), b = segment(part, smoothing(0.1)).pockets.at(0);
    EXPECT_EQ(a.outline, b.outline);
    EXPECT_EQ(a.volume, b.volume);
    EXPECT_EQ(a.peak, b.peak);
  }
}

}  // namespace
}  // namespace debulk::smooth_outline_test
