#include "debulk/ridge/ridge_height.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

double three_nodes(double spacing, double centre) {
  return ridge_height(2 * spacing, 2 * std::sqrt(spacing * spacing - centre * centre), 0.3);
}

TEST(RidgeHeight, SymmetricThreeNodesOnAFlatMold) {  // docs/model.md, section 5
  EXPECT_NEAR(three_nodes(8.40, 4.66), 1.540, 5e-4);
  EXPECT_NEAR(three_nodes(9.3, 3.2), 0.697, 5e-4);
}

TEST(RidgeHeight, IsHalfTheExcessAndAConstantOfTheThickness) {
  const double pi = std::acos(-1.0);
  for (const double t : {0.1, 0.3, 0.5})
    for (const double mold : {2.0, 10.0, 100.0})
      for (const double excess : {0.0, 0.05, 1.0, 4.0}) {
        const double base = (mold - 2 * t) / 2;
        EXPECT_NEAR(ridge_height(mold + excess, mold, t), (mold + excess - 2 * base - pi * t) / 2 + t, 1e-12);
        EXPECT_NEAR(ridge_height(mold + excess, mold, t), excess / 2 + 0.4292 * t, 1e-4 * t + 1e-12);
      }
}

TEST(RidgeHeight, NamesWhatIsWrong) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](double ply, double mold, double t) -> std::string {
    try {
      ridge_height(ply, mold, t);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  EXPECT_EQ(message(10, 9, 0.0).find("thickness_mm"), 0u);
  EXPECT_EQ(message(10, 9, nan).find("thickness_mm"), 0u);
  EXPECT_EQ(message(0, 9, 0.3).find("ply_length_mm"), 0u);
  EXPECT_EQ(message(nan, 9, 0.3).find("ply_length_mm"), 0u);
  EXPECT_EQ(message(10, 0.59, 0.3).find("mold_length_mm"), 0u);
  EXPECT_NE(message(10, 0.59, 0.3).find("0.59"), std::string::npos);
  EXPECT_EQ(message(10, nan, 0.3).find("mold_length_mm"), 0u);
}

}  // namespace
}  // namespace debulk
