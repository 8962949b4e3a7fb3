#include "debulk/cloud/made_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clouds.hpp"

namespace debulk {
namespace {

using namespace testing;

constexpr MadeLimits limits{0.25, 30.0, 1e-3, 0.35, 0.02, 0.3, 7};

// Differences of normal noise, some of them not seen, and marks of copies and of the ply.
struct Asked {
  int ways, rows, columns;
  std::vector<float> apart;
  std::vector<std::uint8_t> copied, on;

  Asked(int all_ways, int r, int c, double copies, std::uint64_t seed = 1)
      : ways(all_ways), rows(r), columns(c), copied(size()), on(size()) {
    Random random(seed);
    for (std::size_t k = 0; k < static_cast<std::size_t>(ways) * size(); ++k)
      apart.push_back(random.uniform() < 0.03 ? nan : static_cast<float>(0.02 * std::abs(random.normal())));
    for (std::size_t k = 0; k < size(); ++k) copied[k] = random.uniform() < copies, on[k] = random.uniform() < 0.95;
  }
  std::size_t size() const { return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns); }
  float& at(int way, int row, int column) { return apart[way * size() + index(row, column)]; }
  std::size_t index(int row, int column) const { return static_cast<std::size_t>(row * columns + column); }
  MadePoints search(double step_mm = 0, int threads = 2) const {
    return made_points({ways, rows, columns, apart.data(), copied.data(), on.data()}, step_mm, limits, threads);
  }
};

using Marks = std::vector<std::uint8_t>;

float median(std::vector<float> of) {
  std::sort(of.begin(), of.end());
  return of.size() % 2 == 1 ? of[of.size() / 2] : (of[of.size() / 2 - 1] + of[of.size() / 2]) / 2;
}

// The sum of marks over the window around a point, one by one.
int around(const Asked& asked, const Marks& marks, int row, int column) {
  int sum = 0;
  for (int r = std::max(0, row - 3); r <= std::min(asked.rows - 1, row + 3); ++r)
    for (int c = std::max(0, column - 3); c <= std::min(asked.columns - 1, column + 3); ++c) sum += marks[asked.index(r, c)];
  return sum;
}

// What made_points() finds, by its definition.
Marks naive(const Asked& asked) {
  const std::size_t size = asked.size();
  std::vector<float> middle;
  const auto difference = [&](int way, std::size_t k) { return asked.apart[way * size + k]; };
  for (int way = 0; way < asked.ways; ++way) {
    std::vector<float> known;
    for (std::size_t k = 0; k < size; ++k)
      if (asked.on[k] && std::isfinite(difference(way, k))) known.push_back(difference(way, k));
    middle.push_back(median(known));
  }
  Marks copies(size), made(size);
  std::vector<float> shares;
  for (std::size_t k = 0; k < size; ++k) copies[k] = asked.copied[k] & asked.on[k];
  for (int r = 0; r < asked.rows; ++r)
    for (int c = 0; c < asked.columns; ++c)
      if (asked.on[asked.index(r, c)])
        shares.push_back(static_cast<float>(around(asked, copies, r, c)) / static_cast<float>(around(asked, asked.on, r, c)));
  if (median(shares) > 0.02f) std::fill(copies.begin(), copies.end(), std::uint8_t{0});
  for (int judged = -1; judged < asked.ways; ++judged) {  // -1: along an axis both ways
    Marks known(size), quiet(size), odd(size);
    double number = 0, quiets = 0, odds = 0;
    for (std::size_t k = 0; k < size; ++k) {
      const auto is_quiet = [&](int way) { return difference(way, k) < 0.25f * middle[way]; };
      const auto seen = [&](int way) { return std::isfinite(difference(way, k)); };
      bool still = false;
      for (int way = 0; way < asked.ways; way += 2) still |= is_quiet(way) && is_quiet(way + 1);
      known[k] = asked.on[k] && (judged < 0 ? seen(0) && seen(1) : seen(judged));
      odd[k] = known[k] && (copies[k] || (difference(0, k) > 30 * middle[0] && difference(1, k) > 30 * middle[1]));
      quiet[k] = known[k] && !odd[k] && (judged < 0 ? still : is_quiet(judged));
      number += known[k], quiets += quiet[k], odds += odd[k];
    }
    const double all_odd = std::clamp(odds / number, 0.02, 0.48), all_quiet = std::clamp(quiets / number, 0.02, 0.48);
    for (int r = 0; r < asked.rows; ++r)
      for (int c = 0; c < asked.columns; ++c) {
        const int n = around(asked, known, r, c), still = around(asked, quiet, r, c), wild = around(asked, odd, r, c);
        const double log_odds = wild * std::log(0.35 / all_odd) + still * std::log(0.35 / all_quiet) +
                                (n - still - wild) * std::log(0.3 / (1 - all_odd - all_quiet));
        if (asked.on[asked.index(r, c)] && n >= 0.3 * 49 && log_odds > 0) made[asked.index(r, c)] = 1;
      }
  }
  return made;
}

long count(const Marks& marks) {
  return std::count(marks.begin(), marks.end(), 1);
}

TEST(MadePoints, AreThoseOfTheDefinitionOnAnyNumberOfThreads) {
  for (const int ways : {2, 4})
    for (const double copies : {0.0, 0.01, 0.04}) {
      Asked asked(ways, 83, 61, copies);
      for (int r = 20; r < 34; ++r)
        for (int c = 8; c < 24; ++c) asked.at(0, r, c) *= 0.2f, asked.at(1, r, c + 20) = 3, asked.at(0, r, c + 20) = 2;
      for (int r = 50; r < 60; ++r)
        for (int c = 30; c < 45; ++c) asked.copied[asked.index(r, c)] = (r + c) % 2 == 0;
      const Marks expected = naive(asked);
      EXPECT_GT(count(expected), 200);
      EXPECT_LT(count(expected), 2000);
      for (const int threads : {1, 2, 5}) EXPECT_EQ(asked.search(0, threads).made, expected);
    }
}

TEST(MadePoints, MarksSayWhatIsOddAboutAPoint) {
  Asked asked(4, 30, 30, 0);
  std::fill(asked.on.begin(), asked.on.end(), 1);
  for (int way = 0; way < 4; ++way)
    for (int k = 0; k < 30 * 30; ++k) asked.apart[static_cast<std::size_t>(way * 900 + k)] = 0.02f;
  asked.at(0, 5, 5) = asked.at(1, 5, 5) = 0;  // along one axis both ways
  asked.at(1, 5, 6) = asked.at(2, 5, 6) = 0;  // one way along either axis
  asked.at(0, 6, 5) = asked.at(1, 6, 5) = 1;
  asked.at(0, 6, 6) = 1, asked.at(1, 6, 6) = nan;
  asked.copied[asked.index(7, 5)] = asked.copied[asked.index(7, 6)] = 1;
  asked.on[asked.index(7, 6)] = 0;
  const MadePoints out = asked.search();
  Marks expected(3 * 900);
  for (const std::size_t k : {asked.index(5, 5), 900 + asked.index(7, 5), 1800 + asked.index(6, 5)}) expected[k] = 1;
  EXPECT_EQ(out.marks, expected);
  EXPECT_EQ(count(out.made), 0);
}

TEST(MadePoints, CopiesCountUnlessTheMedianOfTheirSharesIsAboveTheLimit) {
  Asked asked(2, 1, 8, 0);  // each of eight points sees all within three of it
  std::fill(asked.on.begin(), asked.on.end(), 1), std::fill(asked.apart.begin(), asked.apart.end(), 0.02f);
  asked.copied[0] = 1;  // four points see it, four do not: the median is half of a fifth to a seventh
  EXPECT_EQ(count(asked.search().marks), 0);
  asked.on[7] = 0, asked.on[6] = 0;  // four of six
  EXPECT_EQ(count(asked.search().marks), 0);
  asked.copied[0] = 0, asked.copied[7] = 1;  // off the ply
  EXPECT_EQ(count(asked.search().marks), 0);
  std::fill(asked.on.begin(), asked.on.end(), 1);
  asked.copied[7] = 0;
  Asked longer(2, 1, 9, 0);
  std::fill(longer.on.begin(), longer.on.end(), 1), std::fill(longer.apart.begin(), longer.apart.end(), 0.02f);
  longer.copied[0] = 1;  // four of nine
  EXPECT_EQ(count(longer.search().marks), 1);
}

TEST(MadePoints, WithoutNoiseNoneAreFoundAndRoundedDepthsHideIt) {
  Asked asked(2, 40, 40, 0);
  EXPECT_FALSE(asked.search().rounded);
  const float least = 0.25f * 0.02f * 0.6745f;  // a quarter of the median of the size of normal noise
  EXPECT_FALSE(asked.search(0.9 * least).rounded);
  EXPECT_TRUE(asked.search(1.1 * least).rounded);
  for (int r = 10; r < 30; ++r)
    for (int c = 10; c < 30; ++c) asked.at(0, r, c) = asked.at(1, r, c) = 0.001f;
  EXPECT_GT(count(asked.search().made), 200);
  EXPECT_EQ(asked.search().made, naive(asked));
  EXPECT_EQ(count(asked.search(1.1 * least).made), 0);
  for (float& one : asked.apart) one *= 0.05f;
  const MadePoints out = asked.search();
  EXPECT_FALSE(out.noisy);
  EXPECT_TRUE(out.made.empty());
  std::fill(asked.on.begin(), asked.on.end(), 0);
  EXPECT_FALSE(asked.search().noisy);
}

TEST(MadePoints, AStopEndsTheSearch) {
  const Asked asked(2, 40, 40, 0);
  Stop stop;
  stop.cancel();
  EXPECT_THROW(made_points({2, 40, 40, asked.apart.data(), asked.copied.data(), asked.on.data()}, 0, limits, 1, stop), Stopped);
}

}  // namespace
}  // namespace debulk
