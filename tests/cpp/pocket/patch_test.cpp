#include "debulk/pocket/patch.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "bells.hpp"
#include "debulk/core/error.hpp"
#include "debulk/pocket/height_noise.hpp"
#include "debulk/pocket/smooth.hpp"
#include "support/cholesky.hpp"

namespace debulk {
namespace {

constexpr double kT = 0.3, kTol = 0.2;

class Bowl : public Surface {
 public:
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s;
    s.height = 10 + p.squaredNorm() / 4000;
    s.gradient = p / 2000;
    s.hessian = Eigen::Matrix2d::Identity() / 2000;
    return s;
  }
};

Grid<float> sum(Grid<float> a, const Grid<float>& b) {
  for (std::size_t k = 0; k < a.size(); ++k) a.values[k] += b.values[k];
  return a;
}

double excess(const Patch& patch, const Eigen::Vector2d& at) {
  const Eigen::Vector2d u = patch.surface.locate(at);
  const int i = static_cast<int>(std::lround(u.x())), j = static_cast<int>(std::lround(u.y()));
  return patch.surface.at(i, j) - patch.reference.at(i, j);
}

TEST(Smooth, ReproducesCubicsAndStatedNoiseReduction) {
  Grid<float> heights(60, 50, {0, 0}, 0.5);
  for (int j = 0; j < 50; ++j)
    for (int i = 0; i < 60; ++i) {
      const double x = 0.05 * (i - 30), y = 0.05 * (j - 25);
      heights.at(i, j) = static_cast<float>(1 + x - 2 * y + x * x - 3 * x * y + 0.5 * y * y + x * x * x - x * x * y);
    }
  const Grid<float> given = heights;
  drop_disc(heights, {12, 12}, 0.9);
  const auto out = smooth_heights(heights, {}, {4.0});
  for (int j = 4; j < 46; ++j)
    for (int i = 4; i < 56; ++i) {
      const bool whole = std::abs(i - 24) > 5 || std::abs(j - 24) > 5;  // a fit with holes is exact for quadratics only
      ASSERT_NEAR(out.at(i, j), given.at(i, j), whole ? 1e-5 : 5e-3) << i << " " << j;
    }
  auto white = heights.like<float>();
  for (std::size_t k = 0; k < white.size(); ++k) white.values[k] = static_cast<float>(0.05 * noise(k));
  const auto calm = smooth_heights(white, {}, {4.0});
  double square = 0;
  for (int j = 4; j < 46; ++j)
    for (int i = 4; i < 56; ++i) square += std::pow(calm.at(i, j), 2);
  EXPECT_NEAR(std::sqrt(square / (42 * 52)) / 0.05, std::sqrt(0.0444), 0.03);
  auto left = white.like<std::uint8_t>();
  for (int j = 10; j < 50; ++j)
    for (int i = 0; i < 30; ++i) left.at(i, j) = 1;
  const auto partly = smooth_heights(white, {}, {4.0}, &left);
  for (std::size_t k = 0; k < left.size(); ++k) ASSERT_EQ(partly.values[k], left.values[k] ? calm.values[k] : white.values[k]);
  EXPECT_EQ(smooth_heights(white, {}, {0.0}).values, white.values);
  EXPECT_THROW(smooth_heights(white, {}, {-1}), InputError);
  EXPECT_THROW(smooth_heights(white, {}, {4, -1}), InputError);
  EXPECT_THROW(smooth_heights(white, {}, {4, 0, 0}), InputError);
}

// The quadratic through the known points of a window, by its normal equations in millimetres; NaN where too few are known.
double fitted(const Grid<float>& heights, int i, int j, int half) {
  std::vector<Eigen::Matrix<double, 6, 1>> rows;
  std::vector<double> values;
  for (int y = -half; y <= half; ++y)
    for (int x = -half; x <= half; ++x) {
      if (!heights.contains(i + x, j + y) || std::isnan(heights.at(i + x, j + y))) continue;
      const double u = heights.spacing * x, v = heights.spacing * y;
      rows.push_back((Eigen::Matrix<double, 6, 1>() << 1, u, v, u * u, u * v, v * v).finished());
      values.push_back(heights.at(i + x, j + y));
    }
  const double least = std::isnan(heights.at(i, j)) ? 0.5 * (2 * half + 1) * (2 * half + 1) : 9;
  if (static_cast<double>(rows.size()) < least) return kUnknown;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(6, 6);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(6);
  for (std::size_t k = 0; k < rows.size(); ++k) matrix += rows[k] * rows[k].transpose(), right += values[k] * rows[k];
  return test::cholesky_solution(matrix, right)[0];
}

TEST(Smooth, IsTheFitOverWhatIsKnownWhateverElseIsAskedFor) {
  // Wider than the loops' steps, higher than a thread's rows; holes inside, at a border and at a row's end, a ply askew.
  Grid<float> heights(150, 140, {0, 0}, 0.5);
  for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] = static_cast<float>(2 + noise(k));
  drop_disc(heights, {20, 30}, 3.0), drop_disc(heights, {74, 12}, 2.0), drop_disc(heights, {45, 69}, 4.0);
  heights.at(100, 100) = kUnknown;
  const PlyMask ply({{-5, 20}, {60, -5}, {80, 60}, {10, 75}}, heights);
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i)
      if (!ply.on_ply(i, j)) heights.at(i, j) = kUnknown;
  constexpr int half = 4;
  const auto all = smooth_heights(heights, ply, {2 * half * heights.spacing});
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i) {
      const double wanted = ply.on_ply(i, j) ? fitted(heights, i, j, half) : heights.at(i, j);
      if (std::isnan(wanted)) {
        ASSERT_EQ(std::isnan(all.at(i, j)), std::isnan(heights.at(i, j))) << i << " " << j;
        continue;
      }
      ASSERT_NEAR(all.at(i, j), wanted, 1e-4) << i << " " << j;
    }

  auto where = heights.like<std::uint8_t>();
  for (int j = 5; j < 130; ++j)  // a strip askew, and one column far from it
    for (int i = 20 + j / 2; i < 40 + j / 2; ++i) where.at(i, j) = where.at(147, j) = 1;
  for (const int threads : {1, 2}) {
    const auto some = smooth_heights(heights, ply, {2 * half * heights.spacing}, &where, threads);
    for (std::size_t k = 0; k < some.size(); ++k) {
      const float wanted = where.values[k] ? all.values[k] : heights.values[k];
      ASSERT_TRUE(some.values[k] == wanted || (std::isnan(some.values[k]) && std::isnan(wanted))) << k;
    }
  }
}

TEST(Smooth, UndoesABlur) {
  Grid<float> heights(60, 50, {0, 0}, 0.5);
  constexpr double variance = 0.7, bend = 0.04;
  for (int j = 0; j < 50; ++j)
    for (int i = 0; i < 60; ++i) {  // a blur adds half its variance times the Laplacian
      const Eigen::Vector2d p = heights.position(i, j) - Eigen::Vector2d(15, 12);
      heights.at(i, j) = static_cast<float>(3 + 0.1 * p.x() - bend / 2 * p.squaredNorm() - variance * bend);
    }
  drop_disc(heights, {10, 12}, 1.6);
  const auto out = smooth_heights(heights, {}, {4.0, variance});
  for (int j = 4; j < 46; ++j)
    for (int i = 4; i < 56; ++i) {
      const Eigen::Vector2d p = heights.position(i, j) - Eigen::Vector2d(15, 12);
      ASSERT_NEAR(out.at(i, j), 3 + 0.1 * p.x() - bend / 2 * p.squaredNorm(), 2e-6) << i << " " << j;
    }
}

TEST(Smooth, TellsTheNoiseInSpiteOfPocketsAndWildPoints) {
  for (const double sigma : {0.02, 0.05, 0.15}) {
    auto heights = sampled_bells({{{100, 100}, 10, 60, 60}, {{220, 80}, 5, 25, 25}}, 300, 200, 1.0, kT);
    for (std::size_t k = 0; k < heights.size(); ++k) {
      heights.values[k] += static_cast<float>(sigma * noise(k));
      if (k % 400 == 0) heights.values[k] += 15;
      if (k % 90 == 0) heights.values[k] = kUnknown;
    }
    EXPECT_NEAR(height_noise(heights) / sigma, 1.0, 0.06);
  }
  EXPECT_TRUE(std::isnan(height_noise(Grid<float>(5, 5, {0, 0}, 1.0, kUnknown))));
}

TEST(Feet, AreWhereTheBellComesDownToTheTolerance) {
  for (const Bell& bell : {Bell{{70.3, 65.7}, 8, 40, 40}, Bell{{70.3, 65.7}, 4, 25, 25}, Bell{{70.3, 65.7}, 12, 55, 25, 0.7}}) {
    const Segmentation s = segment(sampled_bells({bell}, 280, 260, 0.5, kT), {});
    const FootMap feet = find_feet(s, {});
    ASSERT_EQ(feet.feet.size(), 1u);
    EXPECT_EQ(feet.mold_tol_mm, kTol);
    // The smoothing rounds the jump in curvature where a bell begins, which is worst for the steep narrow one.
    EXPECT_NEAR(feet.feet[0].area / bell.area(kTol), 1.0, bell.a == bell.b ? 3e-3 : 7e-3);
    EXPECT_TRUE(feet.feet[0].closed);
    EXPECT_FALSE(feet.feet[0].parted);
    EXPECT_FALSE(feet.feet[0].touches_ply_edge);
    if (bell.a == bell.b) {
      for (const Eigen::Vector2d& p : feet.feet[0].outline) EXPECT_NEAR((p - bell.centre).norm(), bell.a * bell.rho(kTol), 0.1);
    }
  }
}

TEST(Feet, ToleranceRisesWithTheNoise) {
  const Bell bell{{70, 65}, 8, 40, 40};
  auto heights = sampled_bells({bell}, 140, 130, 1.0, kT);
  for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] += static_cast<float>(0.1 * noise(k));
  const FootMap feet = find_feet(segment(heights, {}), {});
  EXPECT_NEAR(feet.noise_mm, 0.1, 0.01);
  EXPECT_DOUBLE_EQ(feet.mold_tol_mm, 3 * feet.noise_mm);
  EXPECT_NEAR(feet.feet.at(0).area / bell.area(feet.mold_tol_mm), 1.0, 0.02);
  EXPECT_TRUE(feet.feet[0].closed);
  FootOptions options;
  options.noise_mm = 0.05;
  EXPECT_EQ(find_feet(segment(heights, {}), options).mold_tol_mm, kTol);
}

TEST(Feet, AreOneWhereThePlyDoesNotComeDownBetweenNeighbours) {
  const Bell left{{50, 60}, 8, 40, 40}, right{{115.5, 60}, 8, 40, 40}, far{{230, 60}, 8, 40, 40};
  const auto heights =
      sum(sum(sampled_bells({left}, 283, 121, 1.0, kT), sampled_bells({right}, 283, 121, 1.0)), sampled_bells({far}, 283, 121, 1.0));
  const Segmentation s = segment(heights, {});
  ASSERT_EQ(s.pockets.size(), 3u);  // the saddle between the first two stands 1.62 mm above the reference
  const FootMap feet = find_feet(s, {});
  double alone = 0;
  for (std::size_t k = 0; k < 3; ++k)
    if (s.pockets[k].centroid.x() > 180) alone = feet.feet[k].area;
  for (std::size_t k = 0; k < 3; ++k) {
    const Foot& foot = feet.feet[k];
    EXPECT_TRUE(foot.closed);
    EXPECT_FALSE(foot.parted);
    const Eigen::Vector2i at = feet.heights.locate(s.pockets[k].centroid).array().round().cast<int>();
    EXPECT_EQ(feet.labels.at(at.x(), at.y()), foot.label);
    if (s.pockets[k].centroid.x() > 180) {
      EXPECT_EQ(foot.label, s.pockets[k].id);
      continue;
    }
    EXPECT_NEAR(foot.box.low.x(), 50 - 40 * left.rho(kTol), 0.5);
    EXPECT_NEAR(foot.box.high.x(), 115.5 + 40 * right.rho(kTol), 0.5);
    EXPECT_GT(foot.area, 1.8 * alone);  // they overlap in a lens
    EXPECT_LT(foot.area, 2 * alone);
  }
}

// A bump that is below the tolerances stands on a pocket's skirt: the pocket's net must span it.
TEST(Feet, TakeInBumpsThatStandOnThem) {
  const Bell pocket{{60, 60}, 8, 40, 40}, decoy{{105, 60}, 6, 12, 12};
  const auto heights = sum(sampled_bells({pocket}, 160, 120, 1.0, kT), sampled_bells({decoy}, 160, 120, 1.0));
  SegmentOptions options;
  options.area_tol_mm2 = 600;  // the decoy is dropped
  const Segmentation s = segment(heights, options);
  ASSERT_EQ(s.pockets.size(), 1u);
  ASSERT_EQ(s.dropped.size(), 1u);
  const FootMap feet = find_feet(s, {});
  EXPECT_EQ(feet.labels.at(105, 60), 1);
  EXPECT_NEAR(feet.feet[0].box.high.x(), 105 + 12 * decoy.rho(kTol), 0.5);
}

TEST(Feet, StopWhereSomethingElseRises) {
  const Bell pocket{{60, 60}, 8, 40, 40}, ripple{{118, 60}, 1.5, 22, 22}, decoy{{60, 121}, 6, 23, 10};
  const auto heights =
      sum(sum(sampled_bells({pocket}, 160, 150, 1.0, kT), sampled_bells({ripple}, 160, 150, 1.0)), sampled_bells({decoy}, 160, 150, 1.0));
  SegmentOptions options;
  options.area_tol_mm2 = 600;  // the decoy is dropped
  const Segmentation s = segment(heights, options);
  ASSERT_EQ(s.pockets.size(), 1u);
  ASSERT_EQ(s.dropped.size(), 1u);
  const FootMap feet = find_feet(s, {});
  EXPECT_EQ(feet.labels.at(118, 60), 0);
  EXPECT_EQ(feet.labels.at(60, 121), 0);
  EXPECT_NEAR(feet.feet[0].area / pocket.area(kTol), 1.0, 0.03);
}

TEST(Feet, AreClosedAlongThePlysEdgeButNotAlongUnknownHeights) {
  const Bell bell{{80.3, 70.2}, 8, 40, 40};
  const auto heights = sampled_bells({bell}, 160, 140, 1.0, kT);
  SegmentOptions options;
  options.ply_outline = Polygon{{10, 10}, {80.3, 10}, {80.3, 130}, {10, 130}};
  const FootMap at_edge = find_feet(segment(heights, options), {});
  EXPECT_TRUE(at_edge.feet.at(0).closed);
  EXPECT_TRUE(at_edge.feet[0].touches_ply_edge);
  EXPECT_NEAR(at_edge.feet[0].area / (bell.area(kTol) / 2), 1.0, 5e-3);

  auto holed = heights;
  drop_disc(holed, bell.centre + Eigen::Vector2d(0, 38), 14);
  EXPECT_FALSE(find_feet(segment(holed, {}), {}).feet.at(0).closed);
  auto spotted = heights;
  drop_disc(spotted, bell.centre + Eigen::Vector2d(0, 36), 1.5);  // small enough for the smoothing to see through
  EXPECT_TRUE(find_feet(segment(spotted, {}), {}).feet.at(0).closed);
  const Bell beyond{{30, 70}, 8, 40, 40};
  EXPECT_FALSE(find_feet(segment(sampled_bells({beyond}, 100, 140, 1.0, kT), {}), {}).feet.at(0).closed);
}

TEST(Feet, AreTheSameForASmallDropOutAtTheRim) {
  const Bell bell{{70, 65}, 8, 40, 40};
  auto heights = sampled_bells({bell}, 140, 130, 1.0, kT);
  drop_disc(heights, bell.centre + Eigen::Vector2d(0, -36), 5);
  drop_disc(heights, bell.centre + Eigen::Vector2d(31, 0), 5);
  const FootMap feet = find_feet(segment(heights, {}), {});
  EXPECT_TRUE(feet.feet.at(0).closed);
  EXPECT_NEAR(feet.feet[0].area / bell.area(kTol), 1.0, 0.01);
}

TEST(Patch, IsTheNetSurfaceInsideAndTheMoldOutside) {
  const Bell bell{{70.3, 65.7}, 8, 40, 40}, other{{150, 130}, 6, 30, 30};
  const Segmentation s = segment(sampled_bells({bell, other}, 200, 180, 1.0, kT), {});
  const Bowl bowl;
  PatchOptions options;
  options.margin_mm = 45;
  const Patch patch = make_patch(s, find_feet(s, {}), 1, bowl, options);
  EXPECT_TRUE(patch.closed);
  EXPECT_EQ(patch.id, 1);
  const Box box = bounding_box(patch.outline);
  EXPECT_LE(patch.surface.origin.x(), box.low.x() - 45);
  EXPECT_GE(patch.surface.position(patch.surface.nx - 1, 0).x(), box.high.x() + 45);
  EXPECT_LT(patch.surface.origin.x(), -5.0);  // beyond the grid on the left, where F goes on
  for (int j = 0; j < patch.surface.ny; ++j)
    for (int i = 0; i < patch.surface.nx; ++i) {
      const Eigen::Vector2d p = patch.surface.position(i, j);
      ASSERT_DOUBLE_EQ(patch.reference.at(i, j), bowl.height(p));
      const double e = patch.surface.at(i, j) - patch.reference.at(i, j), r = (p - bell.centre).norm();
      if (inside(patch.outline, p)) {
        ASSERT_NEAR(e, bell.at(p), 0.02);
      } else if (distance_to_outline(patch.outline, p) > 5) {
        ASSERT_EQ(e, 0.0);
      } else {
        ASSERT_LE(e, kTol + 1e-6) << r;
        ASSERT_GE(e, 0.0);
      }
      if (i > 0) {
        ASSERT_LT(std::abs(e - (patch.surface.at(i - 1, j) - patch.reference.at(i - 1, j))), 0.32);  // no step
      }
    }
}

TEST(Patch, GoesOnPastThePlysEdge) {
  const Bell bell{{80.3, 70.2}, 8, 40, 40};
  SegmentOptions options;
  options.ply_outline = Polygon{{10, 10}, {80.3, 10}, {80.3, 130}, {10, 130}};
  const Segmentation s = segment(sampled_bells({bell}, 160, 140, 1.0, kT), options);
  const Patch patch = make_patch(s, find_feet(s, {}), 1, Bowl(), {});
  EXPECT_TRUE(patch.touches_ply_edge);
  EXPECT_TRUE(patch.closed);
  EXPECT_NEAR(excess(patch, {80, 70}), 8, 0.05);
  EXPECT_NEAR(excess(patch, {82, 70}), 8, 0.2);
  EXPECT_LT(excess(patch, {109, 70}), 0.1);
}

// The last points on the ply may have seen the mold, and beyond each of them stood a streak of its height: a fibre's path that ran along
// the edge was bent by them, and all cells that hung on it.
TEST(Patch, KeepsNoStreaksOfSinglePointsPastThePlysEdge) {
  const Bell bell{{80.3, 70.2}, 4, 40, 40};
  SegmentOptions options;
  options.ply_outline = Polygon{{10, 10}, {80.3, 10}, {80.3, 130}, {10, 130}};
  Grid<float> heights = sampled_bells({bell}, 160, 140, 1.0, kT);
  const Segmentation whole = segment(heights, options);
  for (int j = 45; j < 96; j += 3) heights.at(80, j) = static_cast<float>(kT);
  const Segmentation pitted = segment(heights, options);
  FootOptions as_they_are;
  as_they_are.smooth_mm = 0;
  const Patch right = make_patch(whole, find_feet(whole, as_they_are), 1, Bowl(), {});
  const Patch patch = make_patch(pitted, find_feet(pitted, as_they_are), 1, Bowl(), {});
  for (const int x : {80, 81, 84, 90})
    for (int y = 50; y <= 90; ++y) {
      EXPECT_NEAR(excess(patch, Eigen::Vector2d(x, y)), excess(right, Eigen::Vector2d(x, y)), 0.02) << x << " " << y;
      EXPECT_NEAR(excess(patch, Eigen::Vector2d(x, y)), excess(patch, Eigen::Vector2d(x, y + 1)), 0.25) << x << " " << y;
    }
}

TEST(Patch, OfAStripThatIsAsWideAsThePointsBesideTheEdgeHasTheirHeights) {
  SegmentOptions options;
  options.ply_outline = Polygon{{10, 10}, {80.3, 10}, {80.3, 130}, {10, 130}};
  Grid<float> heights = sampled_bells({}, 160, 140, 1.0, kT);
  for (int j = 20; j < 120; ++j) heights.at(80, j) = 6;
  options.area_tol_mm2 = 20;
  const Segmentation s = segment(heights, options);
  ASSERT_EQ(s.pockets.size(), 1U);
  FootOptions as_they_are;
  as_they_are.smooth_mm = 0;
  EXPECT_NEAR(excess(make_patch(s, find_feet(s, as_they_are), 1, Bowl(), {}), {80, 70}), 6 - kT, 1e-6);
}

TEST(Patch, OfABellWithAnArmAsWideAsThePointsBesideTheEdgeStandsUpToTheArmsEnd) {
  SegmentOptions options;
  options.ply_outline = Polygon{{10, 10}, {80.3, 10}, {80.3, 130}, {10, 130}};
  Grid<float> heights = sampled_bells({{{70, 40}, 6, 20, 20}}, 160, 140, 1.0, kT);
  for (int j = 40; j < 125; ++j) heights.at(80, j) = 6;
  FootOptions as_they_are;
  as_they_are.smooth_mm = 0;
  const Segmentation s = segment(heights, options);
  ASSERT_EQ(s.pockets.size(), 1U);
  const Patch patch = make_patch(s, find_feet(s, as_they_are), 1, Bowl(), {});
  for (int y = 45; y < 120; ++y) EXPECT_GT(excess(patch, Eigen::Vector2d(80, y)), 0.2) << y;
}

// What the patch has above F, and 0 round it, on a grid of its own.
void expect_same_excess(const Segmentation& s, const FootMap& feet, PatchMode mode) {
  for (int id = 1; id <= static_cast<int>(s.pockets.size()); ++id) {
    PatchOptions options;
    options.mode = mode;
    const Patch patch = make_patch(s, feet, id, Bowl(), options);
    const Grid<double> alone = patch_excess(s, feet, id, options, 3);
    EXPECT_LT(alone.size(), patch.surface.size());
    for (int j = 0; j < patch.surface.ny; ++j)
      for (int i = 0; i < patch.surface.nx; ++i) {
        const Eigen::Vector2d u = alone.locate(patch.surface.position(i, j));
        const int a = static_cast<int>(std::lround(u.x())), b = static_cast<int>(std::lround(u.y()));
        const double e = patch.surface.at(i, j) - patch.reference.at(i, j);
        ASSERT_NEAR(e, alone.contains(a, b) ? alone.at(a, b) : 0.0, 1e-12) << id << ": " << i << " " << j;
        if (alone.contains(a, b) && std::min({a, b, alone.nx - 1 - a, alone.ny - 1 - b}) < 3) {
          ASSERT_EQ(alone.at(a, b), 0.0);
        }
      }
  }
}

TEST(Patch, HasTheSameExcessOnAGridOfItsOwn) {
  auto heights = sampled_bells({{{70.3, 65.7}, 8, 40, 25, 0.4}, {{150, 130}, 6, 30, 30}}, 200, 180, 1.0, kT);
  const Segmentation two = segment(heights, {});
  expect_same_excess(two, find_feet(two, {}), PatchMode::foot);
  expect_same_excess(two, find_feet(two, {}), PatchMode::paper);
  drop_disc(heights, {75, 70}, 4);  // within a foot, no height is known there
  const Segmentation holed = segment(heights, {});
  expect_same_excess(holed, find_feet(holed, {}), PatchMode::foot);
  SegmentOptions options;
  options.ply_outline = Polygon{{10, 10}, {80.3, 10}, {80.3, 130}, {10, 130}};
  const Segmentation at_edge = segment(sampled_bells({{{80.3, 70.2}, 8, 40, 40}}, 160, 140, 1.0, kT), options);
  ASSERT_EQ(at_edge.pockets.size(), 1u);
  PatchOptions given;
  const Patch patch = make_patch(at_edge, find_feet(at_edge, {}), 1, Bowl(), given);
  const Grid<double> alone = patch_excess(at_edge, find_feet(at_edge, {}), 1, given, 0);
  const Eigen::Vector2d off_ply(90, 70), u = alone.locate(off_ply);
  EXPECT_GT(excess(patch, off_ply), 1.0);
  EXPECT_NEAR(alone.at(static_cast<int>(std::lround(u.x())), static_cast<int>(std::lround(u.y()))), excess(patch, off_ply), 1e-12);
}

TEST(Patch, OfThePaperIsGluedAtTheCut) {
  const Bell bell{{70.3, 65.7}, 8, 40, 40};
  const Segmentation s = segment(sampled_bells({bell}, 160, 140, 1.0, kT), {});
  PatchOptions options;
  options.mode = PatchMode::paper;
  const Patch patch = make_patch(s, find_feet(s, {}), 1, Bowl(), options);
  EXPECT_EQ(patch.outline, s.pockets[0].outline);
  for (int j = 0; j < patch.surface.ny; ++j)
    for (int i = 0; i < patch.surface.nx; ++i) {
      const Eigen::Vector2d p = patch.surface.position(i, j);
      const double e = patch.surface.at(i, j) - patch.reference.at(i, j);
      if (inside(patch.outline, p)) {
        ASSERT_NEAR(e, kT + bell.at(p), 0.02);
      } else {
        ASSERT_EQ(e, 0.0);
      }
    }
}

TEST(Patch, OfANoisyScanHasLittleFalseExcessLength) {
  const Bell bell{{80.0, 80.0}, 8, 40, 40};
  auto heights = sampled_bells({bell}, 321, 321, 0.5, kT);
  for (std::size_t k = 0; k < heights.size(); ++k) heights.values[k] += static_cast<float>(0.05 * noise(k));
  const Segmentation s = segment(heights, {});
  const Patch patch = make_patch(s, find_feet(s, {}), 1, Bowl(), {});
  const int row = static_cast<int>(std::lround(patch.surface.locate({80, 80}).y()));
  double measured = 0, exact = 0, raw = 0;
  for (int i = 1; i < patch.surface.nx; ++i) {
    const Eigen::Vector2d a = patch.surface.position(i - 1, row), b = patch.surface.position(i, row);
    if (!inside(patch.outline, a) || !inside(patch.outline, b)) continue;
    const double step = patch.surface.spacing, e = patch.surface.at(i, row) - patch.reference.at(i, row),
                 d = patch.surface.at(i - 1, row) - patch.reference.at(i - 1, row);
    const Eigen::Vector2d u = heights.locate(a);
    const int gi = static_cast<int>(std::lround(u.x())), gj = static_cast<int>(std::lround(u.y()));
    measured += std::hypot(step, e - d) - step;
    exact += std::hypot(step, bell.at(b) - bell.at(a)) - step;
    raw += std::hypot(step, heights.at(gi + 1, gj) - heights.at(gi, gj)) - step;
  }
  EXPECT_GT(raw - exact, 0.4);
  EXPECT_LT(std::abs(measured - exact), 0.03);
}

TEST(Patch, NamesWhatIsWrong) {
  const Segmentation s = segment(sampled_bells({{{70, 65}, 8, 40, 40}}, 140, 130, 1.0, kT), {});
  const FootMap feet = find_feet(s, {});
  const Bowl bowl;
  EXPECT_THROW(make_patch(s, feet, 0, bowl, {}), InputError);
  EXPECT_THROW(make_patch(s, feet, 2, bowl, {}), InputError);
  EXPECT_THROW(make_patch(s, FootMap(), 1, bowl, {}), InputError);
  PatchOptions options;
  options.margin_mm = -1;
  EXPECT_THROW(make_patch(s, feet, 1, bowl, options), InputError);
  const auto with = [&](auto change) {
    FootOptions o;
    change(o);
    return find_feet(s, o);
  };
  EXPECT_THROW(with([](auto& o) { o.thickness_mm = -0.1; }), InputError);
  EXPECT_THROW(with([](auto& o) { o.mold_tol_mm = 0; }), InputError);
  EXPECT_THROW(with([](auto& o) { o.mold_tol_mm = 1.8; }), InputError);  // with the thickness above the cut
  EXPECT_THROW(with([](auto& o) { o.smooth_mm = std::nan(""); }), InputError);
  EXPECT_THROW(with([](auto& o) { o.noise_mm = -1; }), InputError);
}

}  // namespace
}  // namespace debulk
