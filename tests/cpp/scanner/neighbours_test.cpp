#include "debulk/scanner/neighbours.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace debulk::neighbours_test {
namespace {

constexpr int width = 61, height = 23;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

std::vector<float> ramp() {
  std::vector<float> phase;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) phase.push_back(100 + 0.1f * static_cast<float>(i) + 0.02f * static_cast<float>(j));
  return phase;
}

TEST(Neighbours, ARampStaysAsItIs) {
  std::vector<float> phase = ramp();
  const NeighbourCounts counts = check_neighbours(phase.data(), width, height, 6.16, 2, Stop());
  EXPECT_EQ(phase, ramp());
  EXPECT_EQ(counts.isolated + counts.repaired, 0);
}

TEST(Neighbours, AWrongOrderAloneGoes) {
  for (int column : {1, 16, 17, 33, 44, 59}) {
    std::vector<float> phase = ramp();
    phase[static_cast<std::size_t>(5 * width + column)] += 6.16f;
    const NeighbourCounts counts = check_neighbours(phase.data(), width, height, 6.16, 1, Stop());
    EXPECT_EQ(counts.isolated, 1) << column;
    EXPECT_TRUE(std::isnan(phase[static_cast<std::size_t>(5 * width + column)]));
  }
}

TEST(Neighbours, ADoubtfulOrderIsDecidedByThoseBeside) {
  for (float orders : {-1.0f, 0.0f, 2.0f}) {
    std::vector<float> phase = ramp();
    const std::size_t at = 7 * width + 20;
    phase[at] = -1 - (phase[at] + orders * 6.16f);
    const NeighbourCounts counts = check_neighbours(phase.data(), width, height, 6.16, 1, Stop());
    EXPECT_EQ(counts.repaired, 1);
    EXPECT_NEAR(phase[at], ramp()[at], 1e-4);
  }
}

TEST(Neighbours, WhereTheyDoNotAgreeItGoes) {
  std::vector<float> phase = ramp();
  for (int j = 0; j < height; ++j)
    for (int i = 30; i < width; ++i) phase[static_cast<std::size_t>(j * width + i)] += 20;  // an edge of depth
  const std::size_t at = 7 * width + 30;
  phase[at] = -1 - phase[at];
  check_neighbours(phase.data(), width, height, 6.16, 1, Stop());
  EXPECT_TRUE(std::isnan(phase[at]));
  EXPECT_FALSE(std::isnan(phase[at + 1]));
}

TEST(Neighbours, NothingDoubtfulIsLeftOnTheBorder) {
  std::vector<float> phase = ramp();
  for (float& p : phase) p = -1 - p;
  check_neighbours(phase.data(), width, height, 6.16, 3, Stop());
  for (float p : phase) EXPECT_TRUE(std::isnan(p));
}

TEST(Neighbours, SameBitsOnAnyInstructionsAndThreads) {
  std::vector<float> spoilt = ramp();
  for (std::size_t i = 0; i < spoilt.size(); ++i) {
    if (i % 7 == 3) spoilt[i] = -1 - spoilt[i] - 6.16f;
    if (i % 11 == 5) spoilt[i] = nan;
    if (i % 13 == 1) spoilt[i] += 6.16f;
  }
  std::vector<float> first = spoilt;
  check_neighbours(first.data(), width, height, 6.16, 1, Stop(), Isa::base);
  for (Isa isa : {Isa::base, Isa::v3, Isa::v4})
    for (int threads : {1, 3}) {
      if (isa > best_isa()) continue;
      std::vector<float> other = spoilt;
      check_neighbours(other.data(), width, height, 6.16, threads, Stop(), isa);
      ASSERT_EQ(std::memcmp(first.data(), other.data(), first.size() * sizeof(float)), 0);
    }
}

}  // namespace
}  // namespace debulk::neighbours_test
