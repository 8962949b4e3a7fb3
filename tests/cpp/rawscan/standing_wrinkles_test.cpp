// A wrinkle that stands already is found with its place, height and width, along rows and along columns; what is spoiled is said
// to be; a raised stop ends the search.

#include "debulk/rawscan/standing_wrinkles.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "flat_scan.hpp"

namespace debulk {
namespace {

using namespace flat_scan;

// A wrinkle through the middle, a squared cosine across it from foot to foot.
Shape wrinkle(double angle, double wide, double high, double from, double to) {
  return [=](double x, double y) {
    const double along = x * std::cos(angle) + y * std::sin(angle), across = y * std::cos(angle) - x * std::sin(angle);
    if (along < from || along > to || std::abs(across) > wide / 2) return 0.0;
    const double c = std::cos(std::acos(-1.0) * across / wide);
    return high * c * c;
  };
}

TEST(StandingWrinkles, AreFoundWithTheirPlaceHeightAndWidth) {
  for (const double degrees : {0.0, 30.0, 60.0, 90.0, 135.0}) {
    const double angle = degrees * std::acos(-1.0) / 180;
    const std::vector<float> scan = scan_of(wrinkle(angle, 4, 6, -70, 70), 0.05);
    const StandingWrinkles found = finder().find(view_of(scan), nullptr, kPitch);
    EXPECT_FALSE(found.gave_up);
    ASSERT_FALSE(found.wrinkles.empty()) << degrees;
    for (const StandingWrinkle& one : found.wrinkles) {
      EXPECT_NEAR(one.height, 6, 0.6) << degrees;
      EXPECT_NEAR(one.width, 2, 1) << degrees;  // half as wide at half its height
      for (const Eigen::Vector2d& p : one.along) {
        EXPECT_LT(std::abs(p.y() * std::cos(angle) - p.x() * std::sin(angle)), 1.0) << degrees;
        EXPECT_LT(p.norm(), 71.0) << degrees;
      }
      EXPECT_GT((one.along.back() - one.along.front()).norm(), 90) << degrees;
    }
  }
}

TEST(StandingWrinkles, AreNoBellsNoNoiseAndNothingThatIsMasked) {
  const WrinkleFinder search = finder();
  const std::vector<float> bell = scan_of([](double x, double y) { return 8 * std::exp(-(x * x + y * y) / 800); }, 0.1);
  EXPECT_TRUE(search.find(view_of(bell), nullptr, kPitch).wrinkles.empty());
  const std::vector<float> scan = scan_of(wrinkle(0, 4, 6, -70, 70));
  EXPECT_FALSE(search.find(view_of(scan), nullptr, kPitch).wrinkles.empty());
  const std::vector<std::uint8_t> masked(static_cast<std::size_t>(kWidth) * kHeight, 1);
  EXPECT_TRUE(search.find(view_of(scan), masked.data(), kPitch).wrinkles.empty());
}

// A few flying pixels, where the pairs of lines are, on a straight way over a pocket: it lifts the way between them, too.
TEST(StandingWrinkles, AreNoFlyingPixelsOverAPocket) {
  const auto pocket = [](double high) -> Shape { return [=](double x, double y) { return high * std::exp(-(x * x + y * y) / 7200); }; };
  const Shape ridge = [&](double x, double y) { return pocket(3)(x, y) + wrinkle(0, 4, 6, -70, 70)(x, y); };
  EXPECT_FALSE(finder().find(view_of(scan_of(ridge, 0.05)), nullptr, kPitch).wrinkles.empty());
  std::vector<float> scan = scan_of(pocket(6), 0.05);
  const int step = static_cast<int>(std::lround(WrinkleOptions().pairs_mm / kPitch));
  for (int row = 4 * step; row < 10 * step; row += step)
    for (const int line : {row, row + 1}) scan[3 * (static_cast<std::size_t>(line) * kWidth + kWidth / 2) + 2] -= 14;
  EXPECT_TRUE(finder().find(view_of(scan), nullptr, kPitch).wrinkles.empty());
}

TEST(StandingWrinkles, AreNotLookedForAmongTooManyCrossingsOnThePly) {
  const std::vector<float> wild = scan_of([](double, double) { return 0.0; }, 1.5);
  WrinkleOptions options;
  options.most = 300;
  EXPECT_TRUE(finder().find(view_of(wild), nullptr, kPitch, options).gave_up);
  // Those off the ply hide nothing on it.
  const Polygon corner{{-110, -85}, {-95, -85}, {-95, -70}, {-110, -70}};
  EXPECT_FALSE(finder(corner).find(view_of(wild), nullptr, kPitch, options).gave_up);
}

TEST(StandingWrinkles, HeedAStop) {
  const std::vector<float> scan = scan_of(wrinkle(0, 4, 6, -70, 70));
  const Stop stop;
  stop.cancel();
  EXPECT_THROW(finder().find(view_of(scan), nullptr, kPitch, {}, stop), Stopped);
}

TEST(Crossings, AreTheHighestPointsOfWhatStandsOutInBothLines) {
  const std::vector<float> scan = scan_of(wrinkle(std::acos(-1.0) / 2, 4, 6, -70, 70));
  CrossingOptions options;
  options.step = 28, options.side = 20;
  const std::vector<Crossing> found = find_crossings({view_of(scan), nullptr, false}, options, 1);
  ASSERT_GE(found.size(), 9u);
  for (const Crossing& c : found) {
    EXPECT_NEAR(c.at, (kWidth - 1) / 2.0, 1);
    EXPECT_NEAR(c.height, 6, 0.3);
  }
  // One of the two lines alone is a flying pixel.
  std::vector<float> flying = scan_of([](double, double) { return 0.0; });
  flying[3 * (static_cast<std::size_t>(options.step) * kWidth + 200) + 2] -= 5;
  EXPECT_TRUE(find_crossings({view_of(flying), nullptr, false}, options, 1).empty());
  flying[3 * ((static_cast<std::size_t>(options.step) + 1) * kWidth + 202) + 2] -= 4;
  const std::vector<Crossing> pair = find_crossings({view_of(flying), nullptr, false}, options, 1);
  ASSERT_EQ(pair.size(), 2u);  // two runs, two pixels from one another
  EXPECT_EQ(pair[0].pair, 1);
  EXPECT_EQ(pair[0].at, 200);
  EXPECT_EQ(pair[1].at, 202);
}

TEST(Chains, GoStraightOnAndEachCrossingBeginsOneAtMost) {
  ChainOptions options;
  options.step = 10;
  std::vector<Crossing> crossings;
  for (int pair = 0; pair < 8; ++pair) {
    if (pair != 4) crossings.push_back({pair, 100 + 5 * pair, 3});  // one lacks
    crossings.push_back({pair, 300 + 100 * pair, 3});               // too steep a way
  }
  const std::vector<std::vector<int>> chains = link_crossings(crossings, options);
  ASSERT_EQ(chains.size(), 1u);
  ASSERT_EQ(chains[0].size(), 7u);
  for (const int c : chains[0]) EXPECT_LT(crossings[static_cast<std::size_t>(c)].at, 200);
  for (Crossing& c : crossings) c.height = std::pow(4, c.pair);  // not alike
  EXPECT_TRUE(link_crossings(crossings, options).empty());
  EXPECT_TRUE(link_crossings({}, options).empty());
}

}  // namespace
}  // namespace debulk
