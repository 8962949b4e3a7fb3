#include "debulk/cloud/neighbours.hpp"

#include <gtest/gtest.h>
#include <random>

#include <algorithm>
#include <cstring>

#include "clouds.hpp"
#include "debulk/cloud/grid_search.hpp"
#include "debulk/cloud/pitch.hpp"
#include "debulk/cloud/tree_search.hpp"
#include "debulk/core/error.hpp"

namespace debulk {
namespace {

using namespace testing;

std::vector<float> brute_force(const CloudView& cloud, int neighbours) {
  std::vector<float> means(cloud.size(), nan), squared;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.seen(i)) continue;
    squared.clear();
    for (std::size_t j = 0; j < cloud.size(); ++j)
      if (j != i && cloud.seen(j)) squared.push_back(squared_distance(cloud.point(i), cloud.point(j)));
    std::sort(squared.begin(), squared.end());
    means[i] = mean_distance(squared.data(), std::min<int>(neighbours, static_cast<int>(squared.size())));
  }
  return means;
}

::testing::AssertionResult same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  if (a.size() != b.size()) return ::testing::AssertionFailure() << a.size() << " against " << b.size() << " values";
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!(a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]))))
      return ::testing::AssertionFailure() << "at " << i << ": " << a[i] << " against " << b[i];
  return ::testing::AssertionSuccess();
}

// What the trees find of all points.
std::vector<float> by_trees(const CloudView& cloud, int neighbours, int threads) {
  std::vector<float> means(cloud.size(), nan);
  std::vector<std::uint32_t> seen;
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (cloud.seen(i)) seen.push_back(static_cast<std::uint32_t>(i));
  TreeSearch(cloud, neighbours, threads, Stop()).mean_distances(seen, means.data(), threads, Stop());
  return means;
}

// Grid and trees, on 1, 2 and 4 threads, against brute force.
void expect_exact(const Cloud& cloud, int neighbours) {
  const std::vector<float> exact = brute_force(cloud.view(), neighbours);
  for (const int threads : {1, 2, 4}) {
    EXPECT_TRUE(same_bits(mean_neighbour_distances(cloud.view(), neighbours, threads), exact)) << "grid, threads " << threads;
    EXPECT_TRUE(same_bits(by_trees(cloud.view(), neighbours, threads), exact)) << "trees, threads " << threads;
  }
}

TEST(Neighbours, AreExactOnASheetWithFlyingPixelsAndDropOuts) {
  for (const int neighbours : {1, 4, 9}) expect_exact(sheet(70, 50, 3), neighbours);
}

TEST(Neighbours, OfASheetAreNearlyAllFoundByTheGrid) {
  const Cloud cloud = sheet(300, 200, 5);
  std::vector<float> means(cloud.view().size(), nan);
  const auto left = GridSearch(cloud.view(), 4, 2, Stop()).mean_distances(means.data());
  EXPECT_LT(left.size(), 60u);
  std::vector<float> complete = by_trees(cloud.view(), 4, 2);
  for (const auto i : left) complete[i] = nan;
  EXPECT_TRUE(same_bits(means, complete));
}

TEST(Neighbours, AreExactOnSheetsThatStandUpright) {
  Cloud cloud = sheet(60, 50, 7);
  for (std::size_t i = 0; i < cloud.view().size(); ++i) std::swap(cloud.xyz[3 * i], cloud.xyz[3 * i + 2]);
  expect_exact(cloud, 4);
}

TEST(Neighbours, AreExactOnAWallAmongASheet) {
  Random random(11);
  expect_exact(make(60, 60,
                    [&](int i, int j, float* p) {
                      p[0] = static_cast<float>(i < 30 ? i : 30 + 1e-3 * random.uniform());
                      p[1] = static_cast<float>(j);
                      p[2] = static_cast<float>(i < 30 ? 0 : 0.2 * (i - 30));
                    }),
               4);
}

TEST(Neighbours, AreExactWithClustersCopiesAndFarPoints) {
  Random random(13);
  expect_exact(make(60, 50,
                    [&](int i, int j, float* p) {
                      const double spread = j < 20 ? 100 : j < 35 ? 0.01 : 0.0;  // sheet, cluster, copies
                      for (int a = 0; a < 3; ++a) p[a] = static_cast<float>(5 + spread * random.uniform() * (a < 2 ? 1 : 0.01));
                      if (i == 7 && j % 10 == 0) p[0] = 1e6f;
                      if (i == 8 && j % 10 == 0) p[2] = -300.0f - static_cast<float>(j);
                    }),
               4);
}

TEST(Neighbours, AreExactOnDegenerateClouds) {
  const auto one_place = [](int, int, float* p) { p[0] = 1, p[1] = 2, p[2] = 3; };
  expect_exact(make(40, 40, one_place), 4);
  expect_exact(make(40, 40, [](int i, int j, float* p) { p[0] = 0, p[1] = static_cast<float>(i + 40 * j) * 0.3f, p[2] = 0; }), 4);
  expect_exact(make(40, 40, [](int i, int j, float* p) { p[0] = p[1] = p[2] = static_cast<float>(i + 40 * j) * 0.3f; }), 4);
  expect_exact(make(2, 2, [](int i, int j, float* p) { p[0] = static_cast<float>(i), p[1] = static_cast<float>(j), p[2] = 0; }), 4);
  expect_exact(make(3, 3, [](int i, int j, float* p) { p[0] = i == 1 && j == 1 ? 1 : nan, p[1] = p[2] = 0; }), 4);
  expect_exact(make(3, 3, [](int, int, float* p) { p[0] = nan, p[1] = p[2] = 0; }), 4);
  expect_exact(Cloud{}, 4);
}

// Flying pixels at heights of many rings, alone and in runs, some of them beyond the border: left to the boxes of blocks.
TEST(Neighbours, OfPointsFarOffTheSheetAreExactWithoutTheTree) {
  Random random(29);
  Cloud cloud = sheet(160, 140, 31);
  for (int k = 0; k < 80; ++k) {
    const int i = random.below(157), j = random.below(140);
    for (int run = 0; run <= k % 3; ++run) cloud.point(i + run, j)[2] += static_cast<float>(120 * random.uniform() - 60);
    if (k % 10 == 0) cloud.point(i, j)[k % 2] -= 400;
  }
  std::vector<float> means(cloud.view().size(), nan);
  EXPECT_EQ(GridSearch(cloud.view(), 4, 2, Stop()).mean_distances(means.data()).size(), 0u);
  EXPECT_TRUE(same_bits(means, by_trees(cloud.view(), 4, 2)));
}

// Half a million copies, and a cluster of half a million in one cell: minutes if anything were quadratic.
TEST(Neighbours, OfAMillionPointsInTwoPlacesTakeNoQuadraticTime) {
  Random random(17);
  const Cloud cloud = make(1000, 1000, [&](int, int j, float* p) {
    for (int a = 0; a < 3; ++a) p[a] = static_cast<float>(j < 500 ? 1.0 : 2e3 + 1e-2 * random.uniform());
  });
  const std::vector<float> means = mean_neighbour_distances(cloud.view(), 4, 2);
  EXPECT_EQ(means[0], 0.0f);
  EXPECT_LT(means.back(), 1e-2f);
}

// Several trees, among them one for points of equal x, and points far off: what the grid finds, in the order of the scan and
// in none, wherever the cloud lies.
TEST(Neighbours, OfMoreThanOneTreeHaveTheSameBits) {
  Random random(37);
  for (const float shift : {0.0f, -130.0f, 900.0f}) {
    Cloud cloud = sheet(700, 500, 41);
    for (int j = 0; j < cloud.height; ++j)
      for (int i = 0; i < cloud.width; ++i) {
        if (i >= 650) cloud.point(i, j)[0] = 0.55f * 650;  // a wall
        cloud.point(i, j)[0] += shift;
      }
    cloud.point(3, 4)[0] = 1e30f, cloud.point(5, 6)[0] = -1e30f;
    const std::vector<float> means = mean_neighbour_distances(cloud.view(), 4, 2);
    EXPECT_TRUE(same_bits(by_trees(cloud.view(), 4, 2), means));
    std::vector<std::size_t> order(means.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
    for (std::size_t k = order.size() - 1; k > 0; --k)
      std::swap(order[k], order[static_cast<std::size_t>(random.below(static_cast<int>(k)))]);
    Cloud mixed = cloud;
    std::vector<float> expected(means.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      std::copy_n(&cloud.xyz[3 * order[k]], 3, &mixed.xyz[3 * k]);
      expected[k] = means[order[k]];
    }
    EXPECT_TRUE(same_bits(by_trees(mixed.flat(), 4, 3), expected)) << shift;
    EXPECT_TRUE(same_bits(mean_neighbour_distances(mixed.flat(), 4, 3), expected)) << shift;
  }
}

// Whatever pattern was not seen: every other point, or two of three, are no reason to ask none.
TEST(Neighbours, OfASampleAreThoseOfAllPoints) {
  for (const std::size_t period : {1, 2, 3, 8}) {
    const Cloud cloud = make(300, 200, [&](int i, int j, float* p) {
      p[0] = static_cast<float>(i), p[1] = static_cast<float>(j), p[2] = static_cast<std::size_t>(300 * j + i) % period == 0 ? 0 : nan;
    });
    const std::vector<float> all = mean_neighbour_distances(cloud.flat(), 4, 2);
    const std::vector<float> some = mean_neighbour_distances(cloud.flat(), 4, 2, Stop(), 16);
    std::size_t asked = 0;
    for (std::size_t k = 0; k < all.size(); ++k) {
      if (std::isnan(some[k])) continue;
      ++asked;
      EXPECT_EQ(some[k], all[k]);
    }
    EXPECT_NEAR(static_cast<double>(asked), 60000.0 / static_cast<double>(16 * period), 10) << period;
  }
}

TEST(Neighbours, SearchStopsWhenTold) {
  Stop stop;
  stop.cancel();
  EXPECT_THROW(mean_neighbour_distances(sheet(50, 50, 1).view(), 4, 1, stop), Stopped);
  EXPECT_THROW(mean_neighbour_distances(sheet(50, 50, 1).flat(), 4, 1, stop), Stopped);
  EXPECT_THROW(mean_neighbour_distances(sheet(5, 5, 1).view(), 0), InputError);
}

TEST(MedianPitch, IsThatOfTheLattice) {
  const Cloud cloud = sheet(120, 90, 19);
  EXPECT_NEAR(median_pitch(cloud.view()), 0.55, 0.005);
  const Cloud flat =
      make(50, 40, [](int i, int j, float* p) { p[0] = 0.8f * static_cast<float>(i), p[1] = 0.8f * static_cast<float>(j), p[2] = 0; });
  EXPECT_NEAR(median_pitch(flat.flat()), 0.8, 1e-5);
  EXPECT_EQ(median_pitch(make(3, 3, [](int, int, float* p) { p[0] = p[1] = p[2] = nan; }).view()), 0.0);
}

TEST(WidestPitch, IsThatBetweenTheLinesOfALineScanner) {
  const Cloud lines =
      make(900, 80, [](int i, int j, float* p) { p[0] = 0.2f * static_cast<float>(i), p[1] = 2.0f * static_cast<float>(j), p[2] = 0; });
  EXPECT_NEAR(widest_pitch(lines.view(), 0.6), 2.0, 1e-5);
  EXPECT_NEAR(widest_pitch(lines.flat(), 0.6), 2.0, 0.4);
  EXPECT_NEAR(median_pitch(lines.flat()), 2.0, 0.4);
}

TEST(WidestPitch, IsNoneOfALatticeNorOfRandomPlaces) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> side(0, 100);
  const Cloud places = make(100, 100, [&](int, int, float* p) { p[0] = side(random), p[1] = side(random), p[2] = 0; });
  const Cloud lattice =
      make(100, 100, [](int i, int j, float* p) { p[0] = static_cast<float>(i), p[1] = static_cast<float>(j), p[2] = 0; });
  EXPECT_NEAR(median_pitch(places.flat()), 0.8, 0.03);
  EXPECT_EQ(widest_pitch(lattice.flat(), 1.0), 1.0);
  EXPECT_EQ(widest_pitch(lattice.view(), 1.0), 1.0);
}

TEST(WidestPitch, SkipsRowsThatWereNotSeen) {
  const Cloud rows =
      make(90, 90, [](int i, int j, float* p) { p[0] = static_cast<float>(i), p[1] = static_cast<float>(j), p[2] = j % 3 == 0 ? 0 : nan; });
  EXPECT_EQ(widest_pitch(rows.view(), 1.0), 3.0);
}

}  // namespace
}  // namespace debulk
