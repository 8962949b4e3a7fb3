// A deadline passes when it should, and one beyond what the clock can count never does.
#include "debulk/core/stop.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace debulk {
namespace {

TEST(Stop, IsNotRaisedBeforeItsDeadline) {
  for (const double seconds : {60.0, 1e9, 1e10, 1e18, 1e300, std::numeric_limits<double>::max(), std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(Stop(seconds).now()) << seconds;
    EXPECT_FALSE(Stop(seconds).past_deadline()) << seconds;
  }
}

TEST(Stop, IsRaisedAtItsDeadline) {
  for (const double seconds : {0.0, 1e-300, -1.0}) EXPECT_TRUE(Stop(seconds).past_deadline()) << seconds;
}

TEST(Stop, SharesItsFlagWithItsCopies) {
  const Stop one;
  const Stop copy = one;
  copy.cancel();
  EXPECT_TRUE(one.cancelled());
  EXPECT_TRUE(one.now());
  EXPECT_FALSE(one.past_deadline());
}

}  // namespace
}  // namespace debulk
