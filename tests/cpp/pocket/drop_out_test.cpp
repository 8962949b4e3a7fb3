#include "debulk/pocket/drop_out.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <thread>

#include "debulk/pocket/components.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

std::vector<std::vector<std::size_t>> unknown_components(const Grid<float>& heights) {
  std::vector<Run> runs;
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i)
      if (std::isnan(heights.at(i, j))) runs.push_back({j, i, i + 1});
  RunJoining joining;
  const Components& found = joining.run(runs);
  std::vector<std::vector<std::size_t>> out(static_cast<std::size_t>(found.count()));
  for (std::size_t c = 0; c < out.size(); ++c)
    for (const Run* run = found.begin(c); run != found.end(c); ++run) out[c].push_back(heights.index(run->begin, run->row));
  return out;
}

// Steps from a known height to the innermost point, as the definition says it: relaxed until nothing changes.
int depth(const Grid<float>& heights, const std::vector<std::size_t>& component) {
  constexpr int far = 1'000'000;
  Grid<int> steps = heights.like<int>(far);
  for (std::size_t k = 0; k < heights.size(); ++k)
    if (!std::isnan(heights.values[k])) steps.values[k] = 0;
  for (bool changed = true; changed;) {
    changed = false;
    for (const std::size_t k : component)
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
          const int i = static_cast<int>(k) % heights.nx + di, j = static_cast<int>(k) / heights.nx + dj;
          if (!heights.contains(i, j) || steps.at(i, j) + 1 >= steps.values[k]) continue;
          steps.values[k] = steps.at(i, j) + 1;
          changed = true;
        }
  }
  int most = 0;
  for (const std::size_t k : component) most = std::max(most, steps.values[k]);
  return most;
}

TEST(DropOut, IsAsThickAsTheDefinitionSays) {
  std::mt19937 random(7);
  int found = 0, components = 0;
  for (int scene = 0; scene < 20; ++scene) {
    Grid<float> heights(70, 55, {0, 0}, 0.7, 1.0F);
    for (int blob = 0; blob < 12; ++blob) {  // discs and bars, overlapping, some across the border
      const auto at = [&](int most) { return static_cast<int>(random() % static_cast<unsigned>(most)); };
      const int ci = at(70), cj = at(55), a = 1 + at(14), b = 1 + at(6);
      for (int j = 0; j < heights.ny; ++j)
        for (int i = 0; i < heights.nx; ++i) {
          const double x = static_cast<double>(i - ci) / a, y = static_cast<double>(j - cj) / b;
          if (blob % 2 ? x * x + y * y < 1 : std::max(std::abs(x), std::abs(y)) < 1) heights.at(i, j) = nan;
        }
    }
    for (const auto& component : unknown_components(heights))
      for (const double bridge : {0.0, 0.7, 1.4, 3.0, 5.0, 12.0}) {
        const bool expected = 2 * heights.spacing * depth(heights, component) <= bridge + heights.spacing;
        std::size_t looked_at = 0;
        EXPECT_EQ(is_drop_out(heights, component, {0.5, bridge}, Stop(), &looked_at), expected) << scene << " " << bridge;
        EXPECT_LE(looked_at, 2 * component.size());
        EXPECT_FALSE(is_drop_out(heights, component, {1.5, bridge}, Stop()));  // no rim is so high
        found += expected, ++components;
      }
  }
  EXPECT_GT(found, components / 10);
  EXPECT_LT(found, components * 9 / 10);
}

TEST(DropOut, OneThatNoKnownHeightBordersOnIsNone) {
  const Grid<float> heights(20, 20, {0, 0}, 1.0, nan);
  EXPECT_FALSE(is_drop_out(heights, unknown_components(heights)[0], {0.0, 1e12}, Stop()));
}

// A scan cut to a part of its rows leaves such a region: the depth of this one took minutes once.
TEST(DropOut, ALargeRegionCostsTwoLooksAtEachOfItsPointsAndHeedsTheStop) {
  Grid<float> heights(2000, 1500, {0, 0}, 0.5, 1.0F);
  std::vector<std::size_t> region;
  for (int j = 200; j < 1400; ++j)
    for (int i = 3; i < 1990; ++i) heights.at(i, j) = nan, region.push_back(heights.index(i, j));
  std::size_t looked_at = 0;
  EXPECT_FALSE(is_drop_out(heights, region, {0.5, 12.0}, Stop(), &looked_at));
  EXPECT_LE(looked_at, region.size() + 13u * 2 * (2000 + 1500));  // the rim, and as many steps inwards as a bridge allows
  EXPECT_TRUE(is_drop_out(heights, region, {0.5, 2000.0}, Stop(), &looked_at));
  EXPECT_LE(looked_at, 2 * region.size());
  Stop stop;
  stop.cancel();
  EXPECT_THROW(is_drop_out(heights, region, {0.5, 12.0}, stop), Stopped);
}

}  // namespace
}  // namespace debulk
