#include "debulk/rawscan/quiet_squares.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "cloud/clouds.hpp"
#include "debulk/core/error.hpp"

namespace debulk {
namespace {

using namespace testing;

const Eigen::Vector3f up = Eigen::Vector3f::UnitZ();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

template <class Height>
Cloud raised(int width, int height, const Height& z) {
  return make(width, height, [&](int i, int j, float* p) {
    p[0] = static_cast<float>(i), p[1] = static_cast<float>(j), p[2] = static_cast<float>(z(i, j));
  });
}

// A slope with white noise, rounded to steps (0: not), and a patch without noise in its middle, rounded as the rest or not.
Cloud scene(double noise, double step, bool patch_rounded, bool patch = true) {
  std::mt19937 generator(1);
  std::normal_distribution<double> white(0, noise);
  return raised(240, 200, [&](int i, int j) {
    const double smooth = 800 + 0.013 * i + 0.021 * j + 1e-4 * i * i, seen = smooth + white(generator);
    const bool inside = patch && std::hypot(i - 120, j - 100) < 30;
    const double z = inside ? smooth : seen;
    return step > 0 && (patch_rounded || !inside) ? std::round(z / step) * step : z;
  });
}

struct Search {
  Cloud cloud;
  SquareLattice lattice;
  std::vector<QuietLimits> limits;
  std::vector<std::uint8_t> quiet;

  explicit Search(Cloud scan, int threads = 0, const std::vector<Eigen::Vector3f>& axes = {up})
      : cloud(std::move(scan)), lattice{cloud.view(), 6} {
    std::vector<int> all(static_cast<std::size_t>(lattice.count()));
    std::iota(all.begin(), all.end(), 0);
    limits = quiet_limits(lattice, all, axes, threads);
    quiet = quiet_squares(lattice, limits, threads);
  }
  int found() const { return std::accumulate(quiet.begin(), quiet.end(), 0); }
  // All within the patch or at its rim.
  bool in_patch() const {
    for (int k = 0; k < lattice.count(); ++k) {
      const float* middle = lattice.point(k, 6, 6);
      if (quiet[static_cast<std::size_t>(k)] && std::hypot(middle[0] - 120, middle[1] - 100) > 30) return false;
    }
    return true;
  }
};

TEST(PixelSquare, DifferencesAreThoseOfAPolynomial) {
  const Cloud cloud = raised(12, 12, [](int i, int) { return i * i * i * i; });
  const RowDifferences<4> fourth(cloud.view().point(0));
  const RowDifferences<2> second(cloud.view().point(0));
  for (int k = 0; k < fourth.count; ++k) EXPECT_EQ(fourth.along(up, k), 24);  // 4!
  for (int k = 0; k < second.count; ++k) EXPECT_EQ(second.along(up, k), 12 * (k + 1) * (k + 1) + 2);
}

TEST(PixelSquare, MissingSidewaysDoesNotCountAlongZ) {
  Cloud cloud = raised(12, 12, [](int i, int) { return i; });
  float row[36];
  std::copy(cloud.view().point(0), cloud.view().point(0) + 36, row);
  row[9] = nan;
  EXPECT_EQ(RowDifferences<4>(row).along(up, 0), 0);
  EXPECT_TRUE(std::isnan(RowDifferences<4>(row).along(Eigen::Vector3f(0.1f, 0, 1), 0)));
}

TEST(PixelSquare, ACubicIsLeftWithNothing) {
  const Cloud cloud = raised(12, 12, [](int i, int j) { return 0.01 * i * i * j - 0.02 * j * j * j + 0.3 * i; });
  const SquareHeights heights({cloud.view(), 12}, 0, up);
  ASSERT_TRUE(heights.whole());
  EXPECT_LT(heights.scatter(), 1e-5);
  EXPECT_EQ(heights.share_beyond(1e-4f), 0);
  for (const float r : row_residuals(cloud.view().point(0, 3), up)) EXPECT_NEAR(r, 0, 1e-5);
}

// Gram's polynomial of degree 4 on 12 points has no part in a cubic; of noise, 134 of 144 degrees of freedom are left.
TEST(PixelSquare, ScatterIsWhatACubicLeaves) {
  const float gram[] = {33, -27, -33, -13, 12, 28, 28, 12, -13, -33, -27, 33};
  const Cloud waves = raised(12, 12, [&](int i, int) { return gram[i]; });
  EXPECT_NEAR(SquareHeights({waves.view(), 12}, 0, up).scatter(), std::sqrt(8008.0 / 12), 1e-4);
  std::mt19937 generator(3);
  std::normal_distribution<double> white(0, 1);
  const Cloud noisy = raised(240, 240, [&](int, int) { return white(generator); });
  const SquareLattice lattice{noisy.view(), 12};
  double squares = 0;
  for (int k = 0; k < lattice.count(); ++k) squares += std::pow(SquareHeights(lattice, k, up).scatter(), 2);
  EXPECT_NEAR(squares / lattice.count(), 134.0 / 144, 0.02);
}

TEST(PixelSquare, HasTheLevelsOfItsSteps) {
  const Cloud stairs = raised(12, 12, [](int i, int j) { return 0.25 * ((i + j) / 4); });
  const SquareHeights::Levels levels = SquareHeights({stairs.view(), 12}, 0, up).levels(1e-4f);
  EXPECT_EQ(levels.count, 6);
  EXPECT_EQ(levels.least_gap, 0.25f);
  EXPECT_EQ(levels.range, 1.25f);
}

TEST(PixelSquare, MayMissATenthOfItsPixels) {
  const auto with = [](int missing) {
    return raised(12, 12, [missing](int i, int j) { return 12 * j + i * 5 % 12 < missing ? nan : 0.1f * static_cast<float>(i); });
  };
  const Cloud few = with(10), many = with(20);
  const SquareHeights heights({few.view(), 12}, 0, up);
  EXPECT_TRUE(heights.whole());
  EXPECT_LT(heights.scatter(), 0.03);
  EXPECT_FALSE(SquareHeights({many.view(), 12}, 0, up).whole());
}

TEST(QuietSquares, AreFoundInAnyNoiseThatStepsDoNotHide) {
  for (const double step : {0.0, 0.01, 0.02, 0.05, 0.075})  // 0.4 steps of noise in the last
    for (const bool rounded : {true, false}) {
      const Search search(scene(0.03, step, rounded));
      EXPECT_TRUE(search.limits[0].told()) << step;
      EXPECT_GE(search.found(), 15) << step << rounded;
      EXPECT_TRUE(search.in_patch()) << step << rounded;
      EXPECT_EQ(Search(scene(0.03, step, rounded, false)).found(), 0) << step;
    }
}

TEST(QuietSquares, AreNotToldWhereStepsHideTheNoise) {
  const Search before(scene(0.01, 0.1, true));
  EXPECT_TRUE(before.limits[0].stepped);
  EXPECT_FALSE(before.limits[0].told());
  EXPECT_EQ(before.found(), 0);
  EXPECT_NEAR(before.limits[0].rounding.at(800), 0.1, 1e-3);
  const Search after(scene(0.01, 0.1, false));  // what was filled in later has heights between the steps
  EXPECT_GE(after.found(), 15);
  EXPECT_TRUE(after.in_patch());
}

TEST(QuietSquares, KnowTheStepsOfADisparity) {
  std::mt19937 generator(1);
  std::normal_distribution<double> white(0, 0.05);
  const double of_step = 800.0 * 800.0 / 0.1;  // z^2 / k: a step of 0.1 mm at 800 mm
  const Cloud cloud = raised(240, 200, [&](int i, int j) {
    const double smooth = 740 + 0.513 * i + 0.021 * j;
    return of_step / std::round(of_step / (std::hypot(i - 120, j - 100) < 30 ? smooth : smooth + white(generator)));
  });
  const Search search(cloud);
  EXPECT_TRUE(search.limits[0].rounding.squared);
  for (const float depth : {740.f, 800.f, 860.f}) EXPECT_NEAR(search.limits[0].rounding.at(depth), depth * depth / of_step, 0.005);
  EXPECT_GE(search.found(), 15);
  EXPECT_TRUE(search.in_patch());
}

TEST(QuietSquares, AreFoundAlongASlantingAxis) {
  const Eigen::Vector3f slanting = Eigen::Vector3f(0.3f, 0, 1).normalized();
  std::mt19937 generator(1);
  std::normal_distribution<double> white(0, 0.03);
  const Cloud cloud = make(240, 200, [&](int i, int j, float* p) {  // noise along the slope of a patch that was clipped to a plane
    const double sideways = white(generator), noise = std::hypot(i - 120, j - 100) < 30 ? -0.3 * sideways : white(generator);
    p[0] = static_cast<float>(i + sideways), p[1] = static_cast<float>(j), p[2] = static_cast<float>(500 - 0.3 * i + noise);
  });
  EXPECT_EQ(Search(cloud).found(), 0);
  const Search search(cloud, 0, {up, slanting});
  EXPECT_GE(search.found(), 15);
  EXPECT_TRUE(search.in_patch());
}

TEST(QuietSquares, HaveTheSameBitsOnAnyNumberOfThreads) {
  for (const double step : {0.0, 0.05}) {
    const Cloud cloud = scene(0.03, step, true);
    const Search one(cloud, 1);
    for (const int threads : {2, 4}) {
      const Search other(cloud, threads);
      EXPECT_EQ(one.quiet, other.quiet);
      EXPECT_EQ(one.limits[0].difference, other.limits[0].difference);
      EXPECT_EQ(one.limits[0].share, other.limits[0].share);
      EXPECT_EQ(one.limits[0].scatter, other.limits[0].scatter);
    }
  }
}

TEST(QuietSquares, HeedAStopAndRefuseWhatIsNoSquare) {
  const Cloud cloud = scene(0.03, 0, true);
  const SquareLattice lattice{cloud.view(), 6};
  Stop stop;
  stop.cancel();
  EXPECT_THROW(quiet_limits(lattice, {0, 1}, {up}, 1, stop), Stopped);
  EXPECT_THROW(quiet_squares(lattice, {QuietLimits()}, 1, stop), Stopped);
  EXPECT_THROW(quiet_limits(lattice, {lattice.count()}, {up}), InputError);
  const Cloud small = scene(0.03, 0, true);
  EXPECT_TRUE(quiet_squares({CloudView{small.view().xyz, 8, 8}, 6}, {QuietLimits()}).empty());
  EXPECT_TRUE(quiet_limits(lattice, {}, {up})[0].difference == 0);
}

}  // namespace
}  // namespace debulk
