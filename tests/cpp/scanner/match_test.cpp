#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "debulk/scanner/stereo.hpp"

namespace debulk::match_test {
namespace {

constexpr int width = 203, height = 16;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

using Rows = std::vector<float>;

Rows rows(const std::function<float(double)>& phase) {
  Rows out;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) out.push_back(phase(i));
  return out;
}

PhaseView view(const Rows& phase, const float* noise = nullptr) {
  PhaseView v;
  v.phase = phase.data(), v.noise = noise, v.width = v.rectified_width = width, v.height = v.rectified_height = height;
  return v;
}

struct Matched {
  Rows disparity = Rows(width * height), sigma = Rows(width * height);
  MatchCounts counts;
};

Matched matched(const Rows& left, const Rows& right, const float* noise = nullptr, StereoOptions options = {}) {
  Matched out;
  StereoMaps maps;
  maps.disparity = out.disparity.data(), maps.sigma = out.sigma.data();
  out.counts = match_rows(view(left, noise), view(right, noise), nullptr, options, maps, Stop());
  return out;
}

float curve(double x) {
  return static_cast<float>(0.1 * x + 0.8 * std::sin(0.03 * x));
}

TEST(Match, FindsPlacesBetweenPixels) {
  for (double shift : {0.0, 0.31, 3.5, -7.77}) {
    const Matched m = matched(rows(curve), rows([&](double x) { return curve(x + shift); }));
    for (int i = 10; i < width - 10; ++i) ASSERT_NEAR(m.disparity[static_cast<std::size_t>(i)], shift, 2e-3) << i;
  }
}

TEST(Match, NeverAcrossAnEdge) {
  // The right camera does not see the phases 8 to 11: a step hides them.
  const Rows left = rows([](double x) { return static_cast<float>(0.1 * x); });
  const Rows right = rows([](double x) { return static_cast<float>(x < 80 ? 0.1 * x : 0.1 * x + 3); });
  const Matched m = matched(left, right);
  for (int i = 80; i < 110; ++i) ASSERT_TRUE(std::isnan(m.disparity[static_cast<std::size_t>(i)])) << i;
  ASSERT_NEAR(m.disparity[60], 0, 1e-3);
  ASSERT_NEAR(m.disparity[150], 30, 1e-3);
  EXPECT_GT(m.counts.unmatched, 0);
}

TEST(Match, NeverAcrossAGap) {
  const Rows left = rows([](double x) { return static_cast<float>(0.1 * x); });
  const Rows right = rows([](double x) { return x == 90 || x == 91 ? nan : static_cast<float>(0.1 * x + 0.05); });
  const Matched m = matched(left, right);
  for (std::size_t i : {90u, 91u, 92u}) EXPECT_TRUE(std::isnan(m.disparity[i])) << i;
  EXPECT_NEAR(m.disparity[94], 0.5, 1e-3);
}

TEST(Match, ASinglePixelIsBridgedButHasNoPointItself) {
  // An order is off in columns 120 and 150. In one row, a pixel has no phase.
  Rows left = rows([](double x) { return static_cast<float>(0.1 * x + (x == 150 ? 6.28 : 0)); });
  Rows right = rows([](double x) { return static_cast<float>(0.1 * x + 0.05 + (x == 120 ? 6.28 : 0)); });
  left[5 * width + 60] = right[5 * width + 90] = nan;
  const Matched m = matched(left, right);
  for (int i = 5; i < width - 5; ++i) {
    const float found = m.disparity[static_cast<std::size_t>(5 * width + i)];
    if (i == 60 || i == 150)
      EXPECT_TRUE(std::isnan(found)) << i;
    else
      EXPECT_NEAR(found, 0.5, 1e-3) << i;
  }
}

TEST(Match, NoBridgeOverPixelsOneAboveTheOther) {
  const Rows left = rows([](double x) { return static_cast<float>(0.1 * x); });
  const Rows right = rows([](double x) { return x == 90 ? nan : static_cast<float>(0.1 * x + 0.05); });
  const Matched m = matched(left, right);
  for (std::size_t i : {90u, 91u}) EXPECT_TRUE(std::isnan(m.disparity[i])) << i;
}

TEST(Match, NoBridgeWhereTheSurfaceSteps) {
  // In the middle the phase changes slowly, so that a step of it is smaller than what counts as an edge.
  const auto slow = [](double x) { return x < 80 ? 0.1 * x : x < 120 ? 8 + 0.05 * (x - 80) : 10 + 0.1 * (x - 120); };
  const Rows left = rows([&](double x) { return static_cast<float>(slow(x)); });
  Rows right = rows([&](double x) { return static_cast<float>(slow(x) + (x > 100 ? 0.15 : 0)); });
  right[5 * width + 100] = nan;
  const Matched m = matched(left, right);
  for (std::size_t i : {100u, 101u, 102u, 103u}) EXPECT_TRUE(std::isnan(m.disparity[5 * width + i])) << i;
  EXPECT_NEAR(m.disparity[5 * width + 98], 0, 1e-3);
  EXPECT_NEAR(m.disparity[5 * width + 108], 3, 1e-2);
}

TEST(Match, APlaceOnTheLastPixelBeforeAGapHasItsSigma) {
  const Rows noise(width * height, 0.01f), left = rows([](double x) { return static_cast<float>(x / 8); });
  const Rows right = rows([](double x) { return x == 90 || x == 91 || x == 100 || x == 101 ? nan : static_cast<float>(x / 8); });
  const Matched m = matched(left, right, noise.data());
  for (std::size_t i : {89u, 92u, 99u, 102u, 202u}) {
    EXPECT_EQ(m.disparity[i], 0) << i;
    EXPECT_NEAR(m.sigma[i], 0.08 * std::sqrt(2), 1e-3) << i;
  }
}

TEST(Match, ThePlaceBetweenTwoSidesOfAGapIsNone) {
  const Rows noise(width * height, 0.01f), left = rows([](double x) { return static_cast<float>(x / 8); });
  // Behind the gap the row begins once more three pixels before: 11.75 stands on both sides of it.
  const Rows right = rows([](double x) { return x == 95 || x == 96 ? nan : static_cast<float>((x < 95 ? x : x - 4) / 8); });
  const Matched m = matched(left, right, noise.data());
  for (int i = 0; i < width; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    EXPECT_EQ(std::isnan(m.disparity[k]), std::isnan(m.sigma[k])) << i;
  }
  EXPECT_TRUE(std::isnan(m.disparity[93]));
}

TEST(Match, FindsWhatASearchOfTheWholeRowFinds) {
  // Noise, a step with a gap, an object in front whose phases come once more, stray pixels; rising and falling.
  for (const double turn : {1.0, -1.0}) {
    const auto surface = [&](double x, double noise) {
      const double object = x > 120 && x < 140 ? -1.5 : x > 60 ? 1 : 0, stray = std::fmod(x, 37) == 5 && x > 150 ? 4 : 0;
      return x > 60 && x < 64 ? nan : static_cast<float>(turn * (curve(x) + object + stray + noise * std::sin(7 * x)));
    };
    const Rows left = rows([&](double x) { return surface(x, 0.04); }), right = rows([&](double x) { return surface(x + 2.3, 0.05); });
    const Matched m = matched(left, right);
    EXPECT_GT(m.counts.matched, m.counts.seen / 2);
    EXPECT_GT(m.counts.ambiguous, 0);
    for (std::size_t i = 0; i < width; ++i) {
      if (std::isnan(m.disparity[i])) continue;
      std::vector<double> places;
      for (std::size_t j = 0; j + 1 < width; ++j) {
        const float a = right[j] - left[i], b = right[j + 1] - left[i];
        if (a * b <= 0 && std::abs(b - a) < 0.3f) places.push_back(static_cast<double>(j) + static_cast<double>(a / (a - b)));
      }
      ASSERT_FALSE(places.empty()) << i;
      EXPECT_NEAR(static_cast<double>(i) - m.disparity[i], 0.5 * (places.front() + places.back()), 1e-3) << i;
    }
  }
}

TEST(Match, WhereNeighboursChangePlacesThePlaceIsTheMiddle) {
  const Rows left = rows(curve);
  Rows right = rows([](double x) { return curve(x + 2.5); });
  for (std::size_t j = 20; j + 1 < width; j += 23)  // the phase of the left pixel j + 3 now comes three times
    right[j] = left[j + 3] + 0.02f, right[j + 1] = left[j + 3] - 0.02f;
  const Matched m = matched(left, right);
  for (std::size_t j = 20; j + 4 < width; j += 23) EXPECT_NEAR(m.disparity[j + 3], 2.5, 0.02) << j;
}

TEST(Match, APhaseInTwoPlacesIsAmbiguous) {
  const Rows left = rows([](double x) { return static_cast<float>(0.1 * x); });
  const Rows right = rows([](double x) { return static_cast<float>(0.1 * (x < 100 ? x : x - 50)); });  // 5 to 10 occur twice
  const Matched m = matched(left, right);
  for (int i = 55; i < 95; ++i) ASSERT_TRUE(std::isnan(m.disparity[static_cast<std::size_t>(i)])) << i;
  EXPECT_NEAR(m.disparity[30], 0, 1e-3);
  EXPECT_GT(m.counts.ambiguous, 0);
  // The other way round the left row is the one that repeats: its partner does not find back to both.
  const Matched back = matched(right, left);
  for (int i = 55; i < 95; ++i) ASSERT_TRUE(std::isnan(back.disparity[static_cast<std::size_t>(i)])) << i;
}

TEST(Match, SigmaFollowsFromThePhasesNoise) {
  const Rows noise(width * height, 0.01f);
  const Matched m = matched(rows([](double x) { return static_cast<float>(0.1 * x); }),
                            rows([](double x) { return static_cast<float>(0.1 * (x + 0.5)); }), noise.data());
  // The left phase's noise and the mean of two right ones', over 0.1 rad a pixel.
  EXPECT_NEAR(m.sigma[100], 0.1 * std::sqrt(1 + 0.5), 1e-3);
}

TEST(Match, TriangulatesAPlane) {
  StereoGeometry g;
  g.focal = 500, g.left_cx = 100, g.right_cx = 90, g.cy = 7, g.baseline = 50, g.nearest = 0, g.furthest = 1e6;
  const double z = 800, d = g.focal * g.baseline / z - (g.right_cx - g.left_cx);
  const Rows left = rows([](double x) { return static_cast<float>(0.1 * x); });
  const Rows right = rows([&](double x) { return static_cast<float>(0.1 * (x + d)); });
  const Rows noise(width * height, 0.01f);
  Rows points(3 * width * height), uncertainty(width * height);
  StereoMaps maps;
  maps.points = points.data(), maps.uncertainty = uncertainty.data();
  match_rows(view(left, noise.data()), view(right, noise.data()), &g, {}, maps, Stop());
  const std::size_t at = 5 * width + 130;
  EXPECT_NEAR(points[3 * at + 2], z, 0.02);
  EXPECT_NEAR(points[3 * at], z * (130 - 100) / 500, 0.01);
  EXPECT_NEAR(points[3 * at + 1], z * (5 - 7) / 500, 0.01);
  EXPECT_NEAR(uncertainty[at] / (0.1 * z * z / (500 * 50)), 1.25, 0.3);  // a pixel's noise of both, interpolated in one
}

TEST(Match, WhatLiesBehindTheCamerasIsCounted) {
  StereoGeometry g;
  g.focal = 500, g.baseline = 50, g.furthest = 1e6;
  Rows points(3 * width * height);
  StereoMaps maps;
  maps.points = points.data();
  const MatchCounts counts = match_rows(view(rows([](double x) { return static_cast<float>(0.1 * x); })),
                                        view(rows([](double x) { return static_cast<float>(0.1 * x - 1); })), &g, {}, maps, Stop());
  EXPECT_EQ(counts.matched, 0);
  EXPECT_GT(counts.behind, 100 * height);
  for (float p : points) ASSERT_TRUE(std::isnan(p));
}

TEST(Match, SameBitsOnAnyInstructionsAndThreads) {
  // Through maps that turn and shift the image, with gaps and an edge.
  Rows left = rows(curve), right = rows([](double x) { return curve(x + 4.3); });
  for (std::size_t i = 0; i < left.size(); i += 17) left[i] = nan, right[(i * 5) % right.size()] += 3;
  Rows map_x, map_y;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) map_x.push_back(0.97f * i + 0.11f * j + 0.3f), map_y.push_back(0.9f * j + 0.004f * i);
  const Rows noise(width * height, 0.01f);
  const auto run = [&](Isa isa, int threads) {
    PhaseView l = view(left, noise.data()), r = view(right, noise.data());
    l.map_x = r.map_x = map_x.data(), l.map_y = r.map_y = map_y.data();
    StereoOptions options;
    options.isa = isa, options.threads = threads;
    Matched out;
    StereoMaps maps;
    maps.disparity = out.disparity.data(), maps.sigma = out.sigma.data();
    out.counts = match_rows(l, r, nullptr, options, maps, Stop());
    return out;
  };
  const Matched first = run(Isa::base, 1);
  EXPECT_GT(first.counts.matched, 1000);
  for (Isa isa : {Isa::base, Isa::v3, Isa::v4})
    for (int threads : {1, 4}) {
      if (isa > best_isa()) continue;
      const Matched other = run(isa, threads);
      ASSERT_EQ(std::memcmp(first.disparity.data(), other.disparity.data(), first.disparity.size() * sizeof(float)), 0);
      ASSERT_EQ(std::memcmp(first.sigma.data(), other.sigma.data(), first.sigma.size() * sizeof(float)), 0);
    }
}

TEST(RectifiedRow, InterpolatesBetweenFourPixelsAndNeverIntoAGap) {
  Rows phase;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) phase.push_back(0.1f * i + 0.03f * j);
  phase[4 * width + 50] = phase[4 * width + 70] = phase[4 * width + 71] = nan;
  Rows map_x, map_y;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) map_x.push_back(i + 0.25f), map_y.push_back(j + (i < 40 ? 0.5f : 0.0f));
  PhaseView v = view(phase);
  v.map_x = map_x.data(), v.map_y = map_y.data(), v.edge = 1;
  RectifiedRow row;
  rectify_row(v, 4, row);
  EXPECT_NEAR(row.phase[10], 0.1 * 10.25 + 0.03 * 4.5, 1e-5);
  EXPECT_NEAR(row.phase[100], 0.1 * 100.25 + 0.03 * 4, 1e-5);
  EXPECT_NEAR(row.phase[49], 0.1 * 49.25 + 0.03 * 4, 1e-5);  // a single pixel is bridged
  EXPECT_NEAR(row.phase[50], 0.1 * 50.25 + 0.03 * 4, 1e-5);
  EXPECT_EQ(row.bridged, std::vector<int>{50});  // the other one is nearer to a pixel with a phase
  for (std::size_t i : {69u, 70u, 71u}) EXPECT_TRUE(std::isnan(row.phase[i])) << i;
  EXPECT_FALSE(std::isnan(row.phase[72]));
  EXPECT_TRUE(std::isnan(row.phase[width - 1]));  // outside the image
}

TEST(RectifiedRow, InterpolatesAtAnyScale) {
  // Sixteen neighbours lie on sixteen pixels, with one left out or twice among them, far apart, or in the other order.
  Rows phase;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) phase.push_back(0.1f * i + 0.03f * j);
  for (const float scale : {0.3f, 0.95f, 1.0f, 1.04f, 1.3f, 3.0f, -1.0f}) {
    Rows map_x, map_y;
    for (int j = 0; j < height; ++j)
      for (int i = 0; i < width; ++i) map_x.push_back((scale < 0 ? 202.5f : 0.0f) + scale * i), map_y.push_back(j + 0.02f * i);
    PhaseView v = view(phase);
    v.map_x = map_x.data(), v.map_y = map_y.data(), v.edge = 1;
    for (const Isa isa : {Isa::base, Isa::v3, Isa::v4}) {
      if (isa > best_isa()) continue;
      RectifiedRow row;
      rectify_row(v, 4, row, isa);
      for (std::size_t i = 0; i < width && map_x[i] <= width - 1 && map_x[i] >= 0; ++i)
        ASSERT_NEAR(row.phase[i], 0.1f * map_x[i] + 0.03f * map_y[4 * width + i], 1e-4) << scale << " " << i;
    }
  }
}

}  // namespace
}  // namespace debulk::match_test
