// The search for feet: a stop ends it soon, with Stopped, and does not affect the next one; floods that run side by side
// give the same feet on any number of threads.
#include "debulk/pocket/foot_contours.hpp"

#include <gtest/gtest.h>

#include "bells.hpp"

namespace debulk {
namespace {

TEST(FindFeet, EndsWhenStopped) {
  const Bell bell{{300, 250}, 8, 260, 220};
  const Segmentation segmentation = segment(sampled_bells({bell}, 1200, 1000, 0.5, 0.3), {});  // some ten milliseconds' work
  const FootMap whole = find_feet(segmentation, {});
  Stop raised;
  raised.cancel();
  EXPECT_THROW(find_feet(segmentation, {}, 0, raised), Stopped);
  for (const double seconds : {-1.0, 1e-5, 1e-4, 1e-3}) EXPECT_THROW(find_feet(segmentation, {}, 0, Stop(seconds)), Stopped) << seconds;
  const FootMap after = find_feet(segmentation, {}, 0, Stop());
  EXPECT_EQ(after.labels.values, whole.labels.values);
  EXPECT_EQ(after.feet.at(0).outline, whole.feet.at(0).outline);
}

// Two pockets that share a foot, one by itself, and a ridge below the cut that a foot takes in; with noise.
TEST(FindFeet, GivesTheSameFeetOnAnyNumberOfThreads) {
  Grid<float> heights = sampled_bells({{{60, 60}, 6, 40, 30}, {{120, 60}, 5, 40, 30}, {{300, 200}, 8, 60, 50}, {{350, 200}, 1.6, 40, 20}},
                                      800, 600, 0.5, 0.3);
  for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] += static_cast<float>(0.05 * noise(k));
  const Segmentation segmentation = segment(heights, {});
  ASSERT_EQ(segmentation.pockets.size(), 3U);
  const FootMap feet = find_feet(segmentation, {}, 1);
  EXPECT_EQ(feet.feet[1].label, feet.feet[2].label);
  EXPECT_NE(feet.feet[0].label, feet.feet[1].label);
  EXPECT_EQ(feet.labels.at(700, 400), feet.feet[0].label) << "of the ridge";
  for (const int threads : {2, 5}) {
    const FootMap again = find_feet(segmentation, {}, threads);
    EXPECT_EQ(again.labels.values, feet.labels.values);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(again.feet[k].outline, feet.feet[k].outline);
  }
}

}  // namespace
}  // namespace debulk
