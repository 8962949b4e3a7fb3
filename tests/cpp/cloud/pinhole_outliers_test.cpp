#include "debulk/cloud/pinhole_outliers.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "clouds.hpp"
#include "debulk/cloud/neighbours.hpp"
#include "debulk/cloud/pinhole.hpp"
#include "debulk/core/error.hpp"

namespace debulk {
namespace {

using namespace testing;

const Pinhole camera{400.0, 149.3, 108.1};

// What a camera sees at 2.4 m of the plane z = depth + a x + b y with a bell of 12 mm and noise along the ray. All of it is
// shrunk to a twelfth; the pitch is 0.5 mm.
Cloud view(double a, double b, double noise, std::uint64_t seed, int width = 300, int height = 220, const Pinhole& by = camera) {
  constexpr double scale = 1.0 / 12;
  Random random(seed);
  return make(width, height, [&](int i, int j, float* p) {
    const double u = by.u(i), v = by.v(j);
    double depth = 2400 / (1 - a * u - b * v);
    const double bell = std::exp(-(std::pow(u * depth + 100, 2) + std::pow(v * depth - 200, 2)) / (2 * 150.0 * 150.0));
    depth = scale * (depth - 144 * bell) + noise * random.normal();
    p[0] = static_cast<float>(u * depth), p[1] = static_cast<float>(v * depth), p[2] = static_cast<float>(depth);
  });
}

void lift(Cloud& cloud, int column, int row, double depth) {
  float* p = cloud.point(column, row);
  const double scale = 1 + depth / p[2];
  for (int k = 0; k < 3; ++k) p[k] = static_cast<float>(p[k] * scale);
}

// With a threshold from a sample of the open points, all are decided as their exact distances say. A multiple of the
// deviation moves the threshold among those of the flying pixels.
void expect_decided(const Cloud& cloud, const char* what, OutlierOptions options, const Pinhole& by, const std::vector<float>& distances) {
  const double ratio = options.std_ratio;
  for (const double more : {0.0, 0.3, 1.0, 4.0}) {
    options.std_ratio = ratio * more;
    std::vector<std::uint8_t> first;
    for (const Isa isa : {Isa::base, Isa::v3, Isa::v4})
      for (const int threads : {1, 2, 4}) {
        if (isa > best_isa()) continue;
        PinholeOutliers fast;
        fast.isa = isa;
        fast.most_measured = 20;
        ASSERT_TRUE(fast.run(cloud.view(), by, options, nullptr, threads)) << what;
        if (first.empty()) {
          first = fast.keep();
          const double threshold = fast.summary().threshold;
          long wrong = 0, decided = 0;
          for (std::size_t k = 0; k < first.size(); ++k) {
            if (!cloud.view().seen(k)) continue;
            const bool above = static_cast<double>(distances[k]) > threshold;
            wrong += (first[k] == 0) != above && !(std::abs(distances[k] / threshold - 1) < 1e-6);
            decided += above;
          }
          EXPECT_EQ(wrong, 0) << what << ", " << more << " times the deviation";
          EXPECT_GT(decided, 0) << what;
        }
        EXPECT_EQ(fast.keep(), first) << what << ", isa " << static_cast<int>(isa) << ", threads " << threads;
      }
  }
}

// The same decisions as the exact search, but for ties with the threshold; on every instruction set and number of threads.
void expect_exact(const Cloud& cloud, const char* what, const OutlierOptions& options = {}, const Pinhole& by = camera) {
  const Outliers exact = remove_outliers(cloud.view(), options, 2);
  const std::vector<float> distances = mean_neighbour_distances(cloud.view(), 4, 2);
  std::vector<std::uint8_t> first;
  double threshold = 0;
  for (const Isa isa : {Isa::base, Isa::v3, Isa::v4})
    for (const int threads : {1, 2, 4})
      for (const double guess : {0.0, exact.threshold, 1.04 * exact.threshold, 3 * exact.threshold}) {
        if (isa > best_isa()) continue;
        PinholeOutliers fast;
        fast.isa = isa;
        fast.guess = guess;
        ASSERT_TRUE(fast.run(cloud.view(), by, options, nullptr, threads)) << what;
        if (first.empty()) {
          first = fast.keep(), threshold = fast.summary().threshold;
          EXPECT_EQ(fast.summary().seen, exact.seen) << what;
          EXPECT_NEAR(threshold / exact.threshold, 1, 1e-7) << what;
          EXPECT_NEAR(fast.summary().mean / exact.mean, 1, 1e-7) << what;
          long wrong = 0;
          for (std::size_t k = 0; k < first.size(); ++k)
            wrong += first[k] != exact.keep[k] && !(std::abs(distances[k] / exact.threshold - 1) < 1e-6);
          EXPECT_EQ(wrong, 0) << what;
          EXPECT_GT(exact.removed, 0) << what;
        }
        EXPECT_EQ(fast.keep(), first) << what << ", isa " << static_cast<int>(isa) << ", threads " << threads << ", guess " << guess;
        EXPECT_EQ(fast.summary().threshold, threshold) << what;
      }
  expect_decided(cloud, what, options, by, distances);
}

TEST(PinholeOutliers, AreTheExactOnesOnANoisyTiltedSheetWithDropOuts) {
  for (const double noise : {0.0, 0.1, 0.4})
    for (const double tilt : {0.0, 0.5}) {
      Cloud cloud = view(tilt, -0.6 * tilt, noise, 3);
      Random random(5);
      for (int k = 0; k < 1200; ++k) cloud.point(random.below(300), random.below(220))[random.below(3)] = nan;
      for (int k = 0; k < 300; ++k) lift(cloud, random.below(300), random.below(220), 40 * random.uniform() - 20);
      expect_exact(cloud, "sheet");
    }
}

TEST(PinholeOutliers, AreTheExactOnesWithFlyingPixelsNearTheSheet) {
  for (const double offset : {0.05, 0.2, 1.0}) {
    Cloud cloud = view(0.2, 0.1, 0.01, 7);
    Random random(9);
    for (int k = 0; k < 600; ++k)
      lift(cloud, random.below(300), random.below(220), (random.uniform() < 0.5 ? -1 : 1) * offset * (0.5 + random.uniform()));
    expect_exact(cloud, "near the sheet");
  }
}

TEST(PinholeOutliers, AreTheExactOnesWithClusters) {
  Cloud cloud = view(0.1, 0.3, 0.05, 11);
  Random random(13);
  for (int k = 0; k < 25; ++k) {  // blocks that fly together, tight and loose, also in front of each other
    const int i = random.below(290), j = random.below(210), size = 1 + random.below(8);
    const double depth = 60 * random.uniform() - 30;
    for (int m = 0; m < size * size; ++m) lift(cloud, i + m % size, j + m / size, depth + (k % 2) * 3 * random.normal());
  }
  expect_exact(cloud, "clusters");
}

TEST(PinholeOutliers, AreTheExactOnesAtHolesBordersAndSteps) {
  Cloud cloud = view(0.3, -0.2, 0.08, 17);
  for (int j = 0; j < 220; ++j)
    for (int i = 0; i < 300; ++i) {
      const bool hole = std::hypot(i - 90, j - 60) < 12 || std::abs(i - 2 * j) < 2 || (i > 250 && j > 180 && (i + j) % 3 != 0);
      if (hole) cloud.point(i, j)[2] = nan;
      if (i < 40) lift(cloud, i, j, 9);  // a step in depth
    }
  lift(cloud, 0, 0, 5), lift(cloud, 299, 219, -5), lift(cloud, 299, 0, 120), lift(cloud, 150, 219, -100);
  expect_exact(cloud, "holes");
  expect_exact(view(0.1, 0.1, 0.2, 19, 301, 67), "a width that is no multiple of 16");
  const Pinhole far{2000.0, 650, 30};
  expect_exact(view(0.1, 0.1, 0.02, 19, 1301, 61, far), "more than one strip", {}, far);
  expect_exact(view(0.1, 0.1, 0.2, 19, 129, 131), "more than two bands");
}

TEST(PinholeOutliers, AreTheExactOnesInStripsWithPointsFarFromAll) {
  Cloud cloud = view(0.1, 0.2, 0.02, 41);
  for (int j = 0; j < 220; ++j)
    for (int i = 0; i < 300; ++i)
      if (i % 100 > 12) cloud.point(i, j)[0] = nan;  // three strips, and points in the empty tiles between them
  for (int k = 0; k < 8; ++k) {
    const Cloud whole = view(0.1, 0.2, 0.02, 41);
    const int i = 40 + 25 * k, j = 17 + 23 * k;
    std::copy_n(&whole.xyz[3 * (static_cast<std::size_t>(j) * 300 + static_cast<std::size_t>(i))], 3, cloud.point(i, j));
  }
  expect_exact(cloud, "strips");
  const Pinhole narrow{1600.0, 10, 550};
  Cloud tall = view(0, 0.1, 0.004, 43, 3, 1100, narrow);
  lift(tall, 1, 500, 9), lift(tall, 0, 800, -7), lift(tall, 2, 1099, 30);
  expect_exact(tall, "three columns", {}, narrow);
}

TEST(PinholeOutliers, AreTheExactOnesInThinRowsOnOneRayAndAtCliffs) {
  for (const double size : {1e-3, 1.0, 1e3}) {  // metres, mm, and a scale that no scanner has
    Cloud rows = view(0.1, 0.2, 0.02, 47);
    Random random(53);
    for (int j = 0; j < 220; ++j)
      for (int i = 0; i < 300; ++i)
        if (j % 40 > 20 + i % 2) rows.point(i, j)[0] = nan;  // parts, and at their ends a row of which every second is missing
    for (int k = 0; k < 300; ++k) lift(rows, 5 + 2 * (k % 140), 22 + 40 * (k / 140), 3 * random.uniform());
    Cloud cliff = view(0.4, 0, 0.02, 59);
    for (int j = 0; j < 220; ++j)
      for (int i = 0; i < 300; ++i)
        if ((i / 37 + j / 29) % 2) lift(cliff, i, j, 30);  // a board of steps, nearly two in a pixel's neighbourhood
    for (int k = 0; k < 400; ++k) lift(cliff, random.below(300), random.below(220), 30 * random.uniform());
    Cloud ray = view(0, 0, 0.01, 61);
    for (int k = 0; k < 2000; ++k) {  // chains that a ray sees end on, and that stand across it
      const int i = 2 + random.below(296), j = random.below(220), length = 1 + random.below(6);
      for (int m = 0; m < length && i + m < 300; ++m) lift(ray, i + (k % 2 ? m : m % 2), j, 2.0 + (k % 3 ? 1.1 * m : 0));
    }
    for (Cloud* cloud : {&rows, &cliff, &ray})
      for (float& value : cloud->xyz) value *= static_cast<float>(size);
    expect_exact(rows, "thin rows");
    expect_exact(cliff, "cliffs");
    expect_exact(ray, "chains");
  }
}

// Of 6 % of pixels that fly up to 40 mm, as wide a spread as any, a sample of 500 gives the threshold to 3 %.
TEST(PinholeOutliers, TakeTheThresholdFromASample) {
  Cloud cloud = view(0.2, 0.1, 0.02, 67);
  Random random(71);
  for (int k = 0; k < 3000; ++k) lift(cloud, random.below(300), random.below(220), 40 * std::pow(random.uniform(), 2));
  const Outliers exact = remove_outliers(cloud.view(), {}, 2);
  PinholeOutliers fast;
  fast.most_measured = 500;
  ASSERT_TRUE(fast.run(cloud.view(), camera, {}, nullptr, 2));
  EXPECT_NE(fast.summary().threshold, exact.threshold);
  EXPECT_NEAR(fast.summary().threshold / exact.threshold, 1, 0.03);
  EXPECT_NEAR(fast.summary().mean / exact.mean, 1, 0.03);
}

TEST(PinholeOutliers, HeedTheOtherOptions) {
  Cloud cloud = view(0.3, -0.2, 0.02, 17);
  for (int k = 0; k < 200; ++k) lift(cloud, 5 + k, 7 + k, k % 2 ? 4 : -0.4);
  expect_exact(cloud, "ratio", {4, 2.5, 0.0});
  expect_exact(cloud, "least", {4, 1.0, 1.5});
  PinholeOutliers fast;
  EXPECT_FALSE(fast.run(cloud.view(), camera, {5, 1.0}, nullptr));
  EXPECT_THROW(fast.run(cloud.view(), camera, {4, -1.0}, nullptr), InputError);
  EXPECT_THROW(fast.run(cloud.view(), {0, 1, 1}, {}, nullptr), InputError);
}

TEST(PinholeOutliers, AreTheExactOnesThoughPointsLieABitOffTheirRays) {
  Cloud cloud = view(0.2, 0.3, 0.1, 23);
  Random random(29);
  for (int j = 0; j < 220; ++j)
    for (int i = 0; i < 300; ++i)
      for (int a = 0; a < 2; ++a) cloud.point(i, j)[a] += static_cast<float>(0.085 * (2 * random.uniform() - 1) * 200 / 400);
  for (int k = 0; k < 300; ++k) lift(cloud, random.below(300), random.below(220), 20 * random.uniform());
  expect_exact(cloud, "off their rays");
}

TEST(PinholeOutliers, LeaveOtherCloudsToTheGeneralSearch) {
  PinholeOutliers fast;
  EXPECT_FALSE(fast.run(sheet(200, 150, 3).view(), camera, {}, nullptr)) << "a grid, not a pinhole's";
  const Cloud good = view(0, 0, 0.1, 3);
  EXPECT_FALSE(fast.run(good.view(), {camera.f, camera.cx + 0.3, camera.cy}, {}, nullptr)) << "another camera";
  EXPECT_FALSE(fast.run(good.flat(), camera, {}, nullptr)) << "unorganised";
  Cloud bad = good;
  for (int a = 0; a < 3; ++a) bad.point(77, 88)[a] = bad.point(78, 88)[a];
  EXPECT_FALSE(fast.run(bad.view(), camera, {}, nullptr)) << "a copy";
  bad = good;
  bad.point(77, 88)[0] += 3;
  EXPECT_FALSE(fast.run(bad.view(), camera, {}, nullptr)) << "one point off its ray";
  bad = good;
  for (int a = 0; a < 3; ++a) bad.point(77, 88)[a] *= -1;
  EXPECT_FALSE(fast.run(bad.view(), camera, {}, nullptr)) << "behind the camera";
  EXPECT_FALSE(fast.run(view(0, 0, 9, 3).view(), camera, {}, nullptr)) << "no sheet";
  EXPECT_FALSE(fast.run(view(0, 0, 0.1, 3, 20, 20).view(), camera, {}, nullptr)) << "few points";
  EXPECT_TRUE(fast.run(good.view(), camera, {}, nullptr));
}

TEST(PinholeOutliers, GiveHeightsAlongTheRays) {
  Cloud cloud = view(0, 0, 0.02, 31);
  lift(cloud, 100, 100, 30);
  cloud.point(17, 9)[1] = nan;
  RayBase base{8, 300 / 8 + 2, 220 / 8 + 2, {}, {}};
  for (int j = 0; j < base.ny; ++j)
    for (int i = 0; i < base.nx; ++i)
      base.depth.push_back(200 + 0.5f * static_cast<float>(i)), base.gain.push_back(-1 - 0.25f * static_cast<float>(j));
  PinholeOutliers fast;
  ASSERT_TRUE(fast.run(cloud.view(), camera, {}, &base));
  for (int j = 0; j < 220; ++j)
    for (int i = 0; i < 300; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * 300 + static_cast<std::size_t>(i);
      if (fast.keep()[k] == 0) {
        EXPECT_TRUE(std::isnan(fast.heights()[k]));
        continue;
      }
      const double expected = (cloud.point(i, j)[2] - (200 + 0.5 * i / 8)) * (-1 - 0.25 * j / 8);
      EXPECT_NEAR(fast.heights()[k], expected, 1e-4);
    }
  EXPECT_EQ(fast.keep()[100 * 300 + 100], 0);
}

TEST(Pinhole, IsFittedToACloud) {
  const std::optional<Pinhole> fitted = fit_pinhole(view(0.3, 0.1, 0.3, 37).view());
  ASSERT_TRUE(fitted.has_value());
  EXPECT_NEAR(fitted->f, camera.f, 1e-3);
  EXPECT_NEAR(fitted->cx, camera.cx, 1e-3);
  EXPECT_NEAR(fitted->cy, camera.cy, 1e-3);
  EXPECT_LT(pinhole_error(view(0.3, 0.1, 0.3, 37).view(), *fitted), 1e-3);
  EXPECT_FALSE(fit_pinhole(sheet(200, 150, 3).view()).has_value());
  EXPECT_FALSE(fit_pinhole(view(0.3, 0.1, 0.3, 37).flat()).has_value());
}

}  // namespace
}  // namespace debulk
