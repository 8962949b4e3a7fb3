#include "debulk/scanner/unwrap_plan.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

TEST(UnwrapPlan, TwoNeighboursBeatOnce) {
  const UnwrapPlan plan = plan_unwrapping({50, 51});
  ASSERT_EQ(plan.stages.size(), 2u);
  EXPECT_EQ(plan.stages[0].periods, 1);
  EXPECT_EQ(plan.stages[0].weights[0], -1);
  EXPECT_EQ(plan.stages[0].weights[1], 1);
  EXPECT_EQ(plan.stages[1].periods, 51);
  // Order of the 51: 51 (p2 - p1) - p2.
  EXPECT_NEAR(plan.order_noise, std::hypot(51, 50), 1e-12);
}

TEST(UnwrapPlan, EveryStageIsMadeOfThePeriods) {
  for (const std::vector<int>& periods : {std::vector<int>{59, 64, 70}, {7, 9}, {1, 16}, {64, 1, 8}, {11, 13, 17, 19}}) {
    const UnwrapPlan plan = plan_unwrapping(periods);
    EXPECT_EQ(plan.stages.front().periods, 1);
    EXPECT_EQ(plan.stages.back().periods, periods[static_cast<std::size_t>(plan.top)]);
    for (const Synthetic& stage : plan.stages) {
      int made = 0;
      for (std::size_t i = 0; i < periods.size(); ++i) made += stage.weights[i] * periods[i];
      EXPECT_EQ(made, stage.periods);
    }
  }
}

TEST(UnwrapPlan, AThirdNumberMakesOrdersSurer) {
  EXPECT_LT(plan_unwrapping({59, 64, 70}).order_noise, 0.25 * plan_unwrapping({69, 70}).order_noise);
}

TEST(UnwrapPlan, RefusesWhatCannotBeUnwrapped) {
  EXPECT_THROW(plan_unwrapping({50}), InputError);
  EXPECT_THROW(plan_unwrapping({50, 50}), InputError);
  EXPECT_THROW(plan_unwrapping({50, 52}), InputError);  // both even: every combination is
  EXPECT_THROW(plan_unwrapping({0, 1}), InputError);
}

}  // namespace
}  // namespace debulk
