// A stop ends the search for feet soon, with Stopped, and the next one is not affected by it.
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

}  // namespace
}  // namespace debulk
