// What filters took from a Gaussian bump is found again from two of them.

#include "debulk/fibre/filter_loss.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

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
    EXPECT_GE(round.high, 1.0);
    const ExcessRange narrow = before_filters(left(w, 1.5, 1.5), left(w, 5, 1.5), 1.5, 5, 0.8);
    EXPECT_GE(narrow.high, 1.0 - 1e-12) << w;
    EXPECT_LE(narrow.mid, 1.0);
    const ExcessRange wide = before_filters(left(w, 1.5, 0.5), left(w, 5, 0.5), 1.5, 5, 0.8);
    EXPECT_NEAR(wide.high, 1.0, 1e-12) << w;
    EXPECT_LE(wide.mid, 1.0);
    for (const ExcessRange& one : {round, narrow, wide}) {
      EXPECT_LE(one.low, 1.0);
      EXPECT_LE(one.low, one.mid);
    }
  }
}

// A wave of the wave number k keeps exp(-v k^2) of its excess: nothing could be wider for the same loss, so its low end is
// what it had. Waves of several numbers had more.
TEST(FilterLoss, GivesAWaveItsExcessAndNoSumOfWavesMore) {
  const auto wave = [](double k, double v) { return std::exp(-v * k * k); };
  for (const double k : {0.1, 0.3, 0.5}) {
    EXPECT_NEAR(before_filters(wave(k, 1.5), wave(k, 5), 1.5, 5, 0.8).low, 1.0, 1e-12) << k;
    for (const double other : {0.2, 0.8, 2.0}) {
      const auto both = [&](double v) { return wave(k, v) + 0.3 * wave(other, v); };
      EXPECT_LT(before_filters(both(1.5), both(5), 1.5, 5, 0.8).low, 1.3) << k << " and " << other;
    }
  }
}

// The excess of the profile (1 - |x/a|^(2n))^2 by the spectrum of its slopes, after a filter of the variance v. With n = 2
// its curvature jumps from flank to top: no Gaussian describes it, and 3 % may be missing at the high end.
TEST(FilterLoss, HoldsSmoothAndSteepFlanksBetweenItsEnds) {
  const double dx = 0.1, dk = 0.02;
  for (const double a : {11.0, 16.0})
    for (const int n : {1, 2}) {
      const auto excess = [&](double v) {
        double sum = 0;
        for (double k = dk; k < 10; k += dk) {
          double wave = 0;
          for (double x = dx; x < a; x += dx) {
            const double r = x / a;
            wave += (1 - std::pow(r, 2 * n)) * std::pow(r, 2 * n - 1) * std::sin(k * x);
          }
          sum += wave * wave * std::exp(-v * k * k);
        }
        return sum;
      };
      const double had = excess(0);
      for (const auto& [fine, coarse] : {std::pair{0.8, 2.67}, std::pair{1.42, 4.75}}) {
        const ExcessRange out = before_filters(excess(fine), excess(coarse), fine, coarse, 0.8);
        EXPECT_LE(out.low, had) << a << " " << n;
        EXPECT_GE(out.high, (n == 1 ? 0.999 : 0.97) * had) << a << " " << n;
        EXPECT_LT(had - out.low, 0.5 * (had - excess(fine))) << "the low end has less than half of the loss: " << a << " " << n;
      }
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
