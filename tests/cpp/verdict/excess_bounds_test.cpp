#include "debulk/verdict/excess_bounds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/ridge/ridge_height.hpp"

namespace debulk {
namespace {

constexpr double kThickness = 0.3, kBulk = 1.2;

double paper_length() {
  return natural_length(360, kThickness, 0.1);
}

TEST(ExcessBounds, NaturalLengthOfThePapersPly) {
  EXPECT_NEAR(paper_length(), std::cbrt(360 * std::pow(0.3, 3) / 12 / 0.1), 1e-12);
  EXPECT_NEAR(paper_length(), 2.0, 0.01);
}

TEST(ExcessBounds, ElasticFoldsNeedLittleExcess) {  // docs/model.md, section 6
  EXPECT_EQ(elastic_fold_height(0, paper_length()), 0);
  EXPECT_NEAR(elastic_fold_height(0.044, paper_length()), 0.3, 2e-3);
  EXPECT_NEAR(elastic_fold_height(0.108, paper_length()), 0.5, 2e-3);
  EXPECT_NEAR(elastic_fold_height(0.362, paper_length()), 1.0, 2e-3);
}

TEST(ExcessBounds, TheElasticFoldIsAnUpperBoundOfTheExactValues) {
  const double exact[][3] = {{0.5, 0.8622, 0.8709}, {1, 1.2444, 1.2693}, {2, 1.7466, 1.8225}};  // dL/l; h/l dead, following
  for (const auto& [excess, dead, following] : exact) {
    EXPECT_GT(elastic_fold_height(excess, 1.0), std::max(dead, following));
    EXPECT_LT(elastic_fold_height(excess, 1.0), 1.13 * dead);
  }
}

TEST(ExcessBounds, FollowTheFormulaAndTheFold) {
  const RidgeBounds none = excess_bounds(0, kThickness, kBulk, paper_length());
  EXPECT_EQ(none.least, 0);
  EXPECT_EQ(none.geometric, 0);
  EXPECT_EQ(none.elastic, 0);
  EXPECT_EQ(excess_bounds(-0.1, kThickness, kBulk, paper_length()).elastic, 0);  // a taut fibre

  const RidgeBounds little = excess_bounds(0.1, kThickness, kBulk, paper_length());
  EXPECT_EQ(little.geometric, 0);  // the formula stays within the consolidated ply
  EXPECT_NEAR(little.elastic, 0.478, 2e-3);

  const RidgeBounds much = excess_bounds(2.0, kThickness, kBulk, paper_length());
  EXPECT_NEAR(much.geometric, 1.0 + 0.4292 * kThickness, 1e-4);
  EXPECT_GT(much.elastic, much.geometric);

  const RidgeBounds huge = excess_bounds(100, kThickness, kBulk, paper_length());
  EXPECT_EQ(huge.elastic, huge.geometric);
}

TEST(ExcessBounds, TheFormulaCountsFromTheConsolidatedThickness) {
  const double height = ridge_height_of_excess(0.3, kThickness);  // 0.279 mm, between 0.25 and 0.36 mm
  EXPECT_EQ(ridge_by_formula(0.3, kThickness, kBulk), height);
  EXPECT_EQ(ridge_by_formula(0.3, kThickness, 1.0), 0);  // a bulk factor of 1 is allowed: 0.3 mm
  EXPECT_EQ(excess_bounds(0.4, kThickness, 1.0, 2).geometric, ridge_height_of_excess(0.4, kThickness));
}

TEST(ExcessBounds, NameWhatIsWrong) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(excess_bounds(nan, 0.3, 1.2, 2), InputError);
  EXPECT_THROW(excess_bounds(1, 0, 1.2, 2), InputError);
  EXPECT_THROW(excess_bounds(1, 0.3, 0.5, 2), InputError);
  EXPECT_THROW(excess_bounds(1, 0.3, 1.2, 0), InputError);
  EXPECT_THROW(natural_length(0, 0.3, 0.1), InputError);
  EXPECT_THROW(natural_length(360, -1, 0.1), InputError);
  EXPECT_THROW(natural_length(360, 0.3, nan), InputError);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double excess : {1.0, -1.0}) {  // a taut fibre's arguments are checked, too
    EXPECT_THROW(excess_bounds(excess, 0, 1.2, 2), InputError);
    EXPECT_THROW(excess_bounds(excess, 0.3, inf, 2), InputError);
    EXPECT_THROW(excess_bounds(excess, 0.3, 0.9, 2), InputError);
    EXPECT_THROW(excess_bounds(excess, 0.3, 1.2, 0), InputError);
  }
  EXPECT_THROW(excess_bounds(-inf, 0.3, 1.2, 2), InputError);
  EXPECT_THROW(ridge_by_formula(nan, 0.3, 1.2), InputError);
  EXPECT_THROW(ridge_by_formula(1, inf, 1.2), InputError);
  EXPECT_THROW(ridge_by_formula(1, 0.3, inf), InputError);
  EXPECT_THROW(ridge_by_formula(1, 0.3, 0.9), InputError);
  EXPECT_THROW(elastic_fold_height(1, 0), InputError);
  EXPECT_THROW(natural_length(360, 0.3, 0), InputError);
  EXPECT_THROW(elastic_fold_height(-1, 2), InputError);
  EXPECT_THROW(elastic_fold_height(nan, 2), InputError);
}

}  // namespace
}  // namespace debulk
