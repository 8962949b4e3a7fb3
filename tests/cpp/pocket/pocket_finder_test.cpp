// Map after map, the finder of pockets gives what segment() and find_feet() give, in memory that is reused.
#include "debulk/pocket/pocket_finder.hpp"

#include <gtest/gtest.h>

#include <utility>

#include "bells.hpp"
#include "debulk/core/error.hpp"
#include "debulk/surface/fill_holes.hpp"
#include "support/taken_memory.hpp"

namespace debulk {
namespace {

HeightMap map_of(const Bell& bell) {
  HeightMap map;
  map.heights = sampled_bells({bell}, 400, 300, 0.5, 0.3);
  map.heights.at(200, 150) = kUnknown;
  map.measured = fill_holes(map.heights);
  return map;
}

SegmentOptions on_a_ply() {
  SegmentOptions options;
  options.ply_outline = Polygon{{5, 5}, {190, 5}, {190, 140}, {5, 140}};
  return options;
}

void expect_found(const FoundPockets& found, const HeightMap& map) {
  const Segmentation s = segment(map.heights, on_a_ply(), &map.measured);
  const FootMap feet = find_feet(s, {});
  EXPECT_EQ(found.segmentation.labels.values, s.labels.values);
  ASSERT_EQ(found.segmentation.pockets.size(), 1U);
  EXPECT_EQ(found.segmentation.pockets[0].outline, s.pockets.at(0).outline);
  EXPECT_EQ(found.segmentation.pockets[0].measured_share, s.pockets.at(0).measured_share);
  EXPECT_LT(found.segmentation.pockets[0].measured_share, 1);
  EXPECT_EQ(found.feet.labels.values, feet.labels.values);
  ASSERT_EQ(found.feet.feet.size(), 1U);
  EXPECT_EQ(found.feet.feet[0].outline, feet.feet.at(0).outline);
}

const HeightMap one = map_of({{100, 75}, 8, 60, 40}), other = map_of({{90, 70}, 6, 40, 50});

TEST(PocketFinder, GivesWhatTheStepsGiveAndLeavesWhatIsHeld) {
  PocketFinder finder;
  const auto held = finder.run(one, on_a_ply(), {});
  const FoundPockets* reused = finder.run(other, on_a_ply(), {}).get();
  EXPECT_NE(reused, held.get());
  expect_found(*held, one);
  Stop raised;
  raised.cancel();
  EXPECT_THROW(finder.run(one, on_a_ply(), {}, 0, raised), Stopped);
  const auto again = finder.run(other, on_a_ply(), {});
  EXPECT_EQ(again.get(), reused);
  expect_found(*again, other);
  expect_found(*held, one);
}

TEST(PocketFinder, TakesNoMapsMemoryForTheSecondMap) {
  PocketFinder finder;
  finder.run(one, on_a_ply(), {}, 1);
  largest_taken = 0;
  finder.run(one, on_a_ply(), {}, 1);
  EXPECT_LT(largest_taken, static_cast<long>(sizeof(float) * one.heights.size())) << "heights or labels of the whole map";
  auto held = finder.run(one, on_a_ply(), {}, 1);
  held = finder.run(other, on_a_ply(), {}, 1);  // as the last report is held until the next one is there
  largest_taken = 0;
  held = finder.run(one, on_a_ply(), {}, 1);
  EXPECT_LT(largest_taken, static_cast<long>(sizeof(float) * one.heights.size()));
}

}  // namespace
}  // namespace debulk
