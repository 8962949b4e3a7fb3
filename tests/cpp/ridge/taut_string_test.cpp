// A string over hollows whose bridge and length are known in closed form.

#include "debulk/ridge/taut_string.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace debulk {
namespace {

MoldSection section(const std::function<double(double)>& height, double half, double step = 0.5) {
  MoldSection out;
  out.step = step;
  const int count = static_cast<int>(half / step);
  for (int k = -count; k <= count; ++k) out.heights.push_back(height(k * step));
  return out;
}

// A round trough 2 a wide between flat banks, as a parabola of radius R.
MoldSection trough(double a, double radius) {
  return section([=](double x) { return std::min(x * x, a * a) / (2 * radius); }, a + 40);
}
// Length of such an arc.
double arc(double a, double radius) {
  return a * std::sqrt(1 + a * a / radius / radius) + radius * std::asinh(a / radius);
}

TEST(TautString, TouchesBothSidesOfAGrooveAlongItsRadius) {
  for (const double slope : {0.1, 0.3})
    for (const double radius : {60.0, 150.0}) {
      const TautString out = taut_string(section([=](double x) { return slope * std::abs(x); }, 100), radius);
      EXPECT_NEAR(out.gap, slope * slope * radius / 2, 1e-3);  // tangent to both at +- slope R
      EXPECT_NEAR(out.lacks, radius * (slope * std::sqrt(1 + slope * slope) - std::asinh(slope)), 1e-3 * out.lacks);
    }
}

TEST(TautString, SpansARoundTroughFromBankToBank) {
  for (const double radius : {200.0, 400.0}) {
    const TautString out = taut_string(trough(40, 150), radius);
    EXPECT_NEAR(out.gap, 40 * 40 / 2.0 * (1 / 150.0 - 1 / radius), 1e-9);
    EXPECT_NEAR(out.lacks, arc(40, 150) - arc(40, radius), 1e-3 * out.lacks);
  }
}

TEST(TautString, LiesInATroughThatIsWider) {
  const TautString out = taut_string(trough(40, 150), 149);
  EXPECT_EQ(out.gap, 0);
  EXPECT_EQ(out.lacks, 0);
}

TEST(TautString, LiesOnAHill) {
  const TautString out = taut_string(section([](double x) { return -x * x / 300; }, 60), 1e5);
  EXPECT_EQ(out.gap, 0);
}

TEST(TautString, IsFoundByWhatItLacks) {
  const TautString groove =
      taut_string_lacking(section([](double x) { return 0.3 * std::abs(x); }, 100), 80 * (0.3 * std::sqrt(1.09) - std::asinh(0.3)), 1e5);
  EXPECT_NEAR(groove.radius, 80, 0.5);
  EXPECT_NEAR(groove.gap, 0.09 * 80 / 2, 0.02);
  const TautString round = taut_string_lacking(trough(40, 150), arc(40, 150) - arc(40, 250), 1e5);
  EXPECT_NEAR(round.radius, 250, 1.5);
  EXPECT_NEAR(round.gap, 800 * (1 / 150.0 - 1 / 250.0), 0.01);
}

TEST(TautString, SlipsToTheRadiusThatIsHeld) {
  const double lacks = arc(40, 150) - arc(40, 250);
  const TautString slips = taut_string_lacking(trough(40, 150), lacks, 180);
  EXPECT_EQ(slips.radius, 180);
  EXPECT_NEAR(slips.gap, 800 * (1 / 150.0 - 1 / 180.0), 1e-9);
  EXPECT_EQ(taut_string_lacking(trough(40, 150), lacks, 140).gap, 0);  // and is drawn in
  EXPECT_EQ(taut_string_lacking(trough(40, 150), lacks, 0).gap, 0);
  EXPECT_EQ(taut_string_lacking(trough(40, 150), -0.1, 1e5).gap, 0);
}

}  // namespace
}  // namespace debulk
