// What filters took from a Gaussian bump is found again from two of them.

#include "debulk/fibre/filter_loss.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace debulk {
namespace {

// Excess that is left of 1 mm on a bump of variance w after a filter of variance v.
double left(double w, double v, double p) {
  return std::pow(w / (w + v), p);
}

TEST(FilterLoss, GivesBackWhatARoundAndALongBumpHad) {
  for (const double w : {4.0, 10.0, 40.0, 400.0}) {
    const ExcessRange round = before_filters(left(w, 1.5, 2.5), left(w, 5, 2.5), 1.5, 5, 0.8);
    EXPECT_NEAR(round.mid, 1.0, 1e-12) << w;
    EXPECT_DOUBLE_EQ(round.low, left(w, 1.5, 2.5));
    EXPECT_GE(round.high, 1.0);
    const ExcessRange narrow = before_filters(left(w, 1.5, 1.5), left(w, 5, 1.5), 1.5, 5, 0.8);
    EXPECT_NEAR(narrow.high, 1.0, 1e-12) << w;
    EXPECT_LE(narrow.mid, 1.0);
  }
}

TEST(FilterLoss, TakesNoBumpToBeNarrowerThanTheLeast) {
  const ExcessRange out = before_filters(0.2, -0.01, 1.5, 5, 0.8);
  EXPECT_DOUBLE_EQ(out.low, 0.2);
  EXPECT_NEAR(out.high, 0.2 * std::pow(1 + 1.5 / 0.8, 2.5), 1e-12);
}

TEST(FilterLoss, AddsNothingWhereTheFiltersTookNothing) {
  for (const double fine : {1.0, 0.0, -0.3}) {
    const ExcessRange out = before_filters(fine, fine, 1.5, 5, 0.8);
    EXPECT_EQ(out.low, fine);
    EXPECT_EQ(out.mid, fine);
    EXPECT_EQ(out.high, fine);
  }
}

}  // namespace
}  // namespace debulk
