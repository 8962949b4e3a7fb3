#include "debulk/pocket/segment.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "bells.hpp"
#include "debulk/core/error.hpp"

namespace debulk {
namespace {

const Polygon kLeftHalf = {{-50, -50}, {80.3, -50}, {80.3, 300}, {-50, 300}};  // edge between grid columns

void expect_bell(const Pocket& p, const Bell& bell, double share = 1, double area_tol = 1e-3, double volume_tol = 3e-3) {
  EXPECT_NEAR(p.area / (share * bell.area(2.0)), 1.0, area_tol);
  EXPECT_NEAR(p.volume / (share * bell.volume(2.0)), 1.0, volume_tol);
}

TEST(Segment, MeasuresARoundBell) {
  for (const double spacing : {0.5, 1.0})
    for (const Bell& bell : {Bell{{60.3, 55.7}, 8, 40, 40}, Bell{{60.1, 50.4}, 4, 26, 26}, Bell{{70.77, 71.13}, 15, 60, 60}}) {
      const auto heights = sampled_bells({bell}, static_cast<int>(150 / spacing), static_cast<int>(140 / spacing), spacing);
      const Segmentation s = segment(heights, {});
      ASSERT_EQ(s.pockets.size(), 1u);
      const Pocket& p = s.pockets[0];
      // The error goes with (spacing / radius)^2: the outline's corners lie on the contour, its sides within.
      expect_bell(p, bell, 1, spacing > 0.5 && bell.a < 30 ? 1.5e-3 : 1e-3);
      EXPECT_EQ(p.id, 1);
      EXPECT_NEAR(p.peak, bell.height, 0.01);
      EXPECT_LT((p.peak_position - bell.centre).norm(), spacing);
      EXPECT_LT((p.centroid - bell.centre).norm(), 0.01);
      EXPECT_NEAR(p.box.high.x() - p.box.low.x(), 2 * bell.a * bell.rho(2.0), 0.05);
      for (const Eigen::Vector2d& v : p.outline) EXPECT_NEAR((v - bell.centre).norm(), bell.a * bell.rho(2.0), 0.03);
      EXPECT_GT(polygon_area(p.outline), 0);
      EXPECT_FALSE(p.touches_ply_edge);
      EXPECT_FALSE(p.touches_unknown);
      EXPECT_EQ(p.measured_share, 1.0);
      const double labelled = static_cast<double>(std::count(s.labels.values.begin(), s.labels.values.end(), 1));
      EXPECT_NEAR(labelled * spacing * spacing / p.area, 1.0, 0.02);
    }
}

TEST(Segment, MeasuresLongNarrowTurnedOnes) {
  for (const double angle : {0.0, 0.3, kPi / 4, 1.2}) {
    const Bell bell{{100.2, 99.6}, 9, 90, 14, angle};
    const Segmentation s = segment(sampled_bells({bell}, 400, 400, 0.5), {});
    ASSERT_EQ(s.pockets.size(), 1u);
    expect_bell(s.pockets[0], bell);
  }
}

TEST(Segment, OrdersByAreaAndNumbersFromOne) {
  const std::vector<Bell> bells = {{{40, 40}, 6, 30, 30}, {{120, 120}, 6, 40, 40}, {{40, 120}, 6, 30, 30}};
  const Segmentation s = segment(sampled_bells(bells, 161, 161, 1.0), {});
  ASSERT_EQ(s.pockets.size(), 3u);
  EXPECT_LT((s.pockets[0].centroid - bells[1].centre).norm(), 0.1);
  EXPECT_LT((s.pockets[1].centroid - bells[0].centre).norm(), 0.1);  // a tie: the one whose first point comes first
  EXPECT_LT((s.pockets[2].centroid - bells[2].centre).norm(), 0.1);
  for (const Pocket& p : s.pockets)
    EXPECT_EQ(s.labels.at(static_cast<int>(std::lround(p.centroid.x())), static_cast<int>(std::lround(p.centroid.y()))), p.id);
}

TEST(Segment, FillsTheHoleOfARing) {
  Grid<float> heights(161, 161, {0, 0}, 1.0);
  const double crest = 45, width = 20;
  for (int j = 0; j < 161; ++j)
    for (int i = 0; i < 161; ++i) {
      const double d = std::abs((heights.position(i, j) - Eigen::Vector2d(80, 80)).norm() - crest);
      heights.at(i, j) = static_cast<float>(d < width ? 6 * std::pow(std::cos(kPi * d / (2 * width)), 2) : 0.0);
    }
  const Segmentation s = segment(heights, {});
  ASSERT_EQ(s.pockets.size(), 1u);
  const double outer = crest + width * 2 / kPi * std::acos(std::sqrt(2.0 / 6));
  EXPECT_NEAR(s.pockets[0].area / (kPi * outer * outer), 1.0, 1e-3);
  EXPECT_EQ(s.labels.at(80, 80), 1);
}

TEST(Segment, JoinsBellsThatMeetAboveTheCutOnly) {
  for (const double distance : {52.0, 56.0}) {  // 2 mm at 26.67 mm from the centre: they meet at 53.33
    const std::vector<Bell> bells = {{{50, 60}, 8, 40, 40}, {{50 + distance, 60}, 8, 40, 40}};
    const Segmentation s = segment(sampled_bells(bells, 160, 120, 1.0), {});
    ASSERT_EQ(s.pockets.size(), distance < 53.3 ? 1u : 2u);
    if (s.pockets.size() == 2) {
      expect_bell(s.pockets[0], bells[0]);
      expect_bell(s.pockets[1], bells[1]);
    }
  }
}

TEST(Segment, JoinsDiagonalNeighboursWithOneOutline) {
  Grid<float> heights(12, 12, {0, 0}, 1.0);
  for (int j = 2; j < 5; ++j)
    for (int i = 2; i < 5; ++i) heights.at(i, j) = heights.at(i + 3, j + 3) = 4;
  SegmentOptions options;
  options.area_tol_mm2 = 0;
  const Segmentation s = segment(heights, options);
  ASSERT_EQ(s.pockets.size(), 1u);
  // Two squares of 3 points with bevelled corners, 9 - 4/8 each, and instead of two bevels a band of 1 - 2/8 between them.
  EXPECT_NEAR(s.pockets[0].area, 2 * (9 - 0.5) + 1 - 0.5, 1e-4);
}

TEST(Segment, EndsAtTheEdgeOfThePlyBelowTheGridSpacing) {
  const Bell bell{{80.3, 70.2}, 8, 40, 40};
  auto heights = sampled_bells({bell}, 160, 140, 1.0);
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i)
      if (heights.position(i, j).x() > 80.3) heights.at(i, j) = j % 3 ? 0.0f : j % 2 ? 9.0f : kUnknown;  // whatever lies beside the ply
  SegmentOptions options;
  options.ply_outline = kLeftHalf;
  const Segmentation s = segment(heights, options);
  ASSERT_EQ(s.pockets.size(), 1u);
  expect_bell(s.pockets[0], bell, 0.5, 3e-3);
  EXPECT_TRUE(s.pockets[0].touches_ply_edge);
  EXPECT_FALSE(s.pockets[0].touches_unknown);
  EXPECT_NEAR(s.pockets[0].box.high.x(), 80.3, 1e-5);

  const double turn = 0.35;  // a slanted edge through the same bell
  const Eigen::Vector2d along(std::cos(turn), std::sin(turn)), left(-std::sin(turn), std::cos(turn)), at = bell.centre;
  options.ply_outline = Polygon{at - 300 * along, at + 300 * along, at + 300 * along + 300 * left, at - 300 * along + 300 * left};
  const Segmentation slanted = segment(sampled_bells({bell}, 160, 140, 1.0), options);
  ASSERT_EQ(slanted.pockets.size(), 1u);
  expect_bell(slanted.pockets[0], bell, 0.5, 3e-3);
  EXPECT_TRUE(slanted.pockets[0].touches_ply_edge);
}

TEST(Segment, TouchesThePlysEdgeWithinTheTolerance) {
  const Bell bell{{50, 70}, 8, 40, 40};  // outline ends at x = 76.67, 3.63 before the edge
  SegmentOptions options;
  options.ply_outline = kLeftHalf;
  EXPECT_FALSE(segment(sampled_bells({bell}, 160, 140, 1.0), options).pockets.at(0).touches_ply_edge);
  options.edge_tol_mm = 4;
  EXPECT_TRUE(segment(sampled_bells({bell}, 160, 140, 1.0), options).pockets.at(0).touches_ply_edge);
}

TEST(Segment, ClosesAlongThePixelsAtTheBorderOfTheGrid) {
  const Bell bell{{-0.5, 70.2}, 8, 40, 40};  // the first column's pixels begin at x = -0.5
  const Segmentation s = segment(sampled_bells({bell}, 100, 140, 1.0), {});
  ASSERT_EQ(s.pockets.size(), 1u);
  expect_bell(s.pockets[0], bell, 0.5, 3e-3);
  EXPECT_TRUE(s.pockets[0].touches_unknown);
}

TEST(Segment, BridgesDropOutsAtRimAndCrown) {
  const Bell bell{{60.3, 55.7}, 8, 40, 40};
  for (const Eigen::Vector2d& at : {Eigen::Vector2d(60.3, 55.7), Eigen::Vector2d(60.3 + 26.67, 55.7), Eigen::Vector2d(45.0, 40.0)}) {
    auto heights = sampled_bells({bell}, 130, 120, 1.0);
    drop_disc(heights, at, 5.0);
    const Segmentation s = segment(heights, {});
    ASSERT_EQ(s.pockets.size(), 1u);
    expect_bell(s.pockets[0], bell, 1, 2e-3, 3e-3);
    EXPECT_NEAR(s.pockets[0].peak, 8, 0.15);
    EXPECT_FALSE(s.pockets[0].touches_unknown);
    EXPECT_LT(s.pockets[0].measured_share, 1.0);
    EXPECT_GT(s.pockets[0].measured_share, 0.95);
  }
}

TEST(Segment, ADropOutNeitherJoinsTwoPocketsNorCutsOne) {
  // The sum of two bells has a smooth saddle, 1.81 mm high: 0.19 mm below the cut, hidden by the drop-out.
  auto saddle = sampled_bells({{{50, 60}, 8, 40, 40}}, 160, 120, 1.0);
  const auto other = sampled_bells({{{112.5, 60}, 8, 40, 40}}, 160, 120, 1.0);
  for (std::size_t k = 0; k < saddle.size(); ++k) saddle.values[k] += other.values[k];
  EXPECT_EQ(segment(saddle, {}).pockets.size(), 2u);
  drop_disc(saddle, {81.2, 60}, 5.0);
  EXPECT_EQ(segment(saddle, {}).pockets.size(), 2u);

  const Bell narrow{{100, 50}, 5, 95, 9};  // 8 mm wide at the cut, crossed by a wider drop-out
  auto crossed = sampled_bells({narrow}, 400, 200, 0.5);
  drop_disc(crossed, {90, 50}, 5.9);
  const Segmentation s = segment(crossed, {});
  ASSERT_EQ(s.pockets.size(), 1u);
  EXPECT_NEAR(s.pockets[0].area / narrow.area(2.0), 1.0, 0.01);
}

TEST(Segment, DoesNotGuessAcrossLargeUnknownRegions) {
  const Bell bell{{60, 60}, 8, 40, 40};
  auto heights = sampled_bells({bell}, 121, 121, 1.0);
  drop_disc(heights, {86, 60}, 12.0);
  const Segmentation open = segment(heights, {});
  ASSERT_EQ(open.pockets.size(), 1u);
  EXPECT_TRUE(open.pockets[0].touches_unknown);
  EXPECT_LT(open.pockets[0].area, 0.95 * bell.area(2.0));
  for (int j = 0; j < 121; ++j)
    for (int i = 0; i < 121; ++i)
      if (std::isnan(heights.at(i, j))) {
        EXPECT_EQ(open.labels.at(i, j), 0);
      }

  auto crown = sampled_bells({bell}, 121, 121, 1.0);  // surrounded: a hole, filled
  drop_disc(crown, {60, 60}, 12.0);
  const Segmentation filled = segment(crown, {});
  ASSERT_EQ(filled.pockets.size(), 1u);
  expect_bell(filled.pockets[0], bell, 1, 1e-3, 2e-2);
  EXPECT_FALSE(filled.pockets[0].touches_unknown);
}

TEST(Segment, CountsAsMeasuredWhatTheMaskSays) {
  const auto heights = sampled_bells({{{60, 60}, 8, 40, 40}}, 121, 121, 1.0);
  auto measured = heights.like<std::uint8_t>(1);
  for (int j = 0; j < 121; ++j)
    for (int i = 0; i < 60; ++i) measured.at(i, j) = 0;
  const Segmentation s = segment(heights, {}, &measured);
  EXPECT_NEAR(s.pockets.at(0).measured_share, 0.5, 0.03);
  ASSERT_EQ(s.unmeasured.size(), 121u);
  for (int j = 0; j < 121; ++j) {
    const debulk::Run& run = s.unmeasured[static_cast<std::size_t>(j)];
    EXPECT_EQ(run.row, j);
    EXPECT_EQ(run.begin, 0);
    EXPECT_EQ(run.end, 60);
  }
  measured.at(119, 120) = 0;
  const Segmentation two = segment(heights, {}, &measured);
  ASSERT_EQ(two.unmeasured.size(), 122u);
  EXPECT_EQ(two.unmeasured.back().begin, 119);
  EXPECT_EQ(two.unmeasured.back().end, 120);
  EXPECT_TRUE(segment(heights, {}).unmeasured.empty());
}

TEST(Segment, DropsWhatIsJustBelowATolerance) {
  const Bell area_like{{60, 60}, 8, 1, 1};
  const double radius = std::sqrt(200 / area_like.area(2.0));  // exactly 200 mm2
  const auto with = [](const Bell& bell) { return segment(sampled_bells({bell}, 240, 240, 0.5), {}); };
  {
    const Segmentation s = with({{60, 60}, 8, radius * 0.99, radius * 0.99});
    EXPECT_TRUE(s.pockets.empty());
    ASSERT_EQ(s.dropped.size(), 1u);
    EXPECT_EQ(s.dropped[0].reason, Dropped::Reason::area);
    EXPECT_NEAR(s.dropped[0].area, 196, 0.5);
    EXPECT_NEAR(s.dropped[0].peak, 8, 0.01);
    for (const auto label : s.labels.values) ASSERT_EQ(label, 0);
  }
  EXPECT_EQ(with({{60, 60}, 8, radius * 1.01, radius * 1.01}).pockets.size(), 1u);
  {
    const Segmentation s = with({{60, 60}, 3.24, 40, 40});
    EXPECT_TRUE(s.pockets.empty());
    ASSERT_EQ(s.dropped.size(), 1u);
    EXPECT_EQ(s.dropped[0].reason, Dropped::Reason::peak);
  }
  EXPECT_EQ(with({{60, 60}, 3.26, 40, 40}).pockets.size(), 1u);
  EXPECT_EQ(with({{60, 60}, 2.1, 20, 20}).dropped.at(0).reason, Dropped::Reason::area_and_peak);
  EXPECT_TRUE(with({{60, 60}, 1.99, 50, 50}).dropped.empty());
}

TEST(Segment, CountsSpecksInsteadOfListingThem) {
  auto heights = sampled_bells({{{60, 60}, 8, 40, 40}}, 121, 121, 1.0);
  heights.at(3, 3) = heights.at(110, 7) = 9;
  const Segmentation s = segment(heights, {});
  EXPECT_EQ(s.pockets.size(), 1u);
  EXPECT_TRUE(s.dropped.empty());
  EXPECT_EQ(s.specks, 2);
}

TEST(Segment, GivesTheSameBitsTwice) {
  auto heights = sampled_bells({{{60, 60}, 8, 40, 40}, {{130, 60}, 5, 30, 20, 0.4}}, 200, 120, 1.0);
  for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] += static_cast<float>(0.1 * noise(k));
  drop_disc(heights, {80, 60}, 5);
  const Segmentation a = segment(heights, {}), b = segment(heights, {});
  ASSERT_EQ(a.pockets.size(), 2u);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(a.pockets[k].area, b.pockets[k].area);
    EXPECT_EQ(a.pockets[k].volume, b.pockets[k].volume);
    EXPECT_EQ(a.pockets[k].outline, b.pockets[k].outline);
  }
  EXPECT_EQ(a.labels.values, b.labels.values);
}

TEST(Segment, NamesWhatIsWrong) {
  const auto heights = sampled_bells({}, 20, 20, 1.0);
  const auto message = [&](auto change) -> std::string {
    SegmentOptions options;
    change(options);
    try {
      segment(heights, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message([](auto& o) { o.cut_height_mm = 0; }).find("cut_height_mm"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.cut_height_mm = std::nan(""); }).find("cut_height_mm"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.area_tol_mm2 = -1; }).find("area_tol_mm2"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.peak_tol_mm = -1; }).find("peak_tol_mm"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.edge_tol_mm = -1; }).find("edge_tol_mm"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.bridge_mm = INFINITY; }).find("bridge_mm"), std::string::npos);
  EXPECT_NE(message([](auto& o) { o.ply_outline = Polygon{{0, 0}, {1, 1}}; }).find("ply_outline"), std::string::npos);
  EXPECT_THROW(segment(Grid<float>(1, 5, {0, 0}, 1.0), {}), InputError);
  EXPECT_THROW(segment(Grid<float>(5, 5, {0, 0}, 0.0), {}), InputError);
  const Grid<std::uint8_t> mask(19, 20, {0, 0}, 1.0);
  EXPECT_THROW(segment(heights, {}, &mask), InputError);
  EXPECT_TRUE(segment(heights, {}).pockets.empty());
}

TEST(Segment, EndsWhenStoppedAndTheNextIsNoneTheWorse) {
  const Grid<float> heights = sampled_bells({{{300, 250}, 8, 260, 220}}, 1200, 1000, 0.5);
  Segmenter segmenter;
  const std::vector<std::int32_t> whole = segmenter.run(heights, {}).labels.values;
  for (const double seconds : {-1.0, 1e-5, 5e-5}) EXPECT_THROW(segmenter.run(heights, {}, nullptr, nullptr, 0, Stop(seconds)), Stopped);
  EXPECT_EQ(segmenter.run(heights, {}).labels.values, whole);
}

}  // namespace
}  // namespace debulk
