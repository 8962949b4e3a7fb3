#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numeric>

#include "debulk/ridge/post_process.hpp"
#include "debulk/ridge/ridge_height.hpp"
#include "test_nets.hpp"

// Which nodes become ridges: two ridges side by side, plateaus, domes, crests that wander, borders, hollows.
namespace debulk {
namespace {

using test::Cylinder;
using test::extruded;
using test::make_net;
using test::Plane;
using test::profile;
using test::TestNet;

constexpr double kBase = 0.3 / 1.2;

PostProcessed run(const TestNet& net, const Surface& mold) {
  return post_process(net.nodes, net.neighbours, net.inside, mold);
}

std::vector<int> ridge_nodes(const PostProcessed& out) {
  std::vector<int> nodes;
  for (std::size_t k = 0; k < out.is_ridge.size(); ++k)
    if (out.is_ridge[k]) nodes.push_back(static_cast<int>(k));
  return nodes;
}

TEST(PostProcessShapes, TwoRidgesShareTheExcessAtTheValley) {
  const double spacing = 8;
  const auto points = profile({0, 4, 0.5, 3, 0}, spacing);
  const PostProcessed out = run(extruded({0, 4, 0.5, 3, 0}, spacing, 1), Plane());
  ASSERT_EQ(ridge_nodes(out), (std::vector<int>{1, 3}));
  EXPECT_NEAR(out.gaps[1], ridge_height_of_excess(2 * spacing - points[2].x(), 0.3), 1e-12);
  EXPECT_NEAR(out.gaps[3], ridge_height_of_excess(2 * spacing - (points[4].x() - points[2].x()), 0.3), 1e-12);
  EXPECT_EQ(out.gaps[2], kBase);
  EXPECT_NEAR(out.sections[0].excess() + out.sections[1].excess(), out.excess_length, 1e-12);
  EXPECT_NEAR(out.ridge_length, spacing, 1e-12);  // two lone peaks, not one ridge of two
}

TEST(PostProcessShapes, AValleyShallowerThanTheTouchGapIsNone) {
  const PostProcessed out = run(extruded({0, 4, 3.995, 4.001, 0}, 8, 1), Plane());
  EXPECT_EQ(ridge_nodes(out), (std::vector<int>{3}));
  EXPECT_EQ(out.sections[0].nodes, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(PostProcessShapes, APlateauFoldsUpIntoOneRidge) {
  const double spacing = 8;
  const PostProcessed out = run(extruded({0, 3, 3, 3, 0}, spacing, 1), Plane());
  EXPECT_EQ(ridge_nodes(out), (std::vector<int>{1}));  // ties: the lower number
  EXPECT_EQ(out.sections[0].nodes, (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_NEAR(out.ridge_height, ridge_height_of_excess(2 * (spacing - std::sqrt(spacing * spacing - 9)), 0.3), 1e-12);
}

// A hill over a square net; in plan the nodes stay on the square grid, which is all that these tests need.
TestNet hill(int side, const std::function<double(int, int)>& height) {
  return make_net(side, side, [&](int i, int j) { return Eigen::Vector3d(6.0 * i, 6.0 * j, height(i, j)); });
}

TEST(PostProcessShapes, ADomeCreasesAcrossOneFibre) {
  const auto dome = hill(7, [](int i, int j) { return std::max(0.0, 4.0 - 0.45 * ((i - 3) * (i - 3) + (j - 3) * (j - 3))); });
  const PostProcessed out = run(dome, Plane());
  // Every row folds at its own top (ties: the first fibre), so the ridge runs along the middle column; the flanks are claimed.
  EXPECT_EQ(ridge_nodes(out), (std::vector<int>{3 + 7, 3 + 14, 3 + 21, 3 + 28, 3 + 35}));
  for (const RidgeSection& section : out.sections) EXPECT_EQ(section.fibre, 0);
  EXPECT_EQ(out.sections[0].peak, 24);
  EXPECT_NEAR(out.ridge_length, 5 * 6.0, 0.5);
}

TEST(PostProcessShapes, ALongHillCreasesAlongItsLongAxis) {
  const auto steep = [](int a, int b) { return std::max(0.0, 4.0 - 1.2 * (a - 3) * (a - 3) - 0.2 * (b - 3) * (b - 3)); };
  const PostProcessed tall = run(hill(7, [&](int i, int j) { return steep(i, j); }), Plane());
  const PostProcessed wide = run(hill(7, [&](int i, int j) { return steep(j, i); }), Plane());
  for (const RidgeSection& section : tall.sections) EXPECT_EQ(section.fibre, 0);
  for (const RidgeSection& section : wide.sections) EXPECT_EQ(section.fibre, 1);
  EXPECT_EQ(tall.ridge_height, wide.ridge_height);
  EXPECT_EQ(tall.ridge_length, wide.ridge_length);
  EXPECT_EQ(tall.rms, wide.rms);
}

TEST(PostProcessShapes, ADiagonalCrestIsOneRidge) {
  const PostProcessed out = run(hill(6, [](int i, int j) { return i == j && i > 0 && i < 5 ? 3.0 : 0.0; }), Plane());
  EXPECT_EQ(ridge_nodes(out), (std::vector<int>{7, 14, 21, 28}));
  EXPECT_NEAR(out.ridge_length, 3 * 6 * std::sqrt(2.0) + std::sqrt(36.0 + 9.0), 1e-9);
}

TEST(PostProcessShapes, TwoRidgesApartAreTwoAndTheLongerCounts) {
  const PostProcessed out =
      run(hill(9, [](int i, int j) { return (i == 2 && j >= 1 && j <= 3) || (i == 6 && j >= 3 && j <= 7) ? 3.0 : 0.0; }), Plane());
  EXPECT_EQ(out.sections.size(), 8u);
  EXPECT_NEAR(out.ridge_length, 4 * 6 + std::sqrt(36.0 + 9.0), 1e-9);
}

TEST(PostProcessShapes, NoRidgeHoldsMoreThanItsFibreHasToSpare) {
  std::uint32_t state = 1;
  const auto next = [&state] { return (state = state * 1664525u + 1013904223u) / 4294967296.0; };
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<double> heights = {0, 0};
    for (int k = 0; k < 10; ++k) heights.insert(heights.end() - 1, next() < 0.3 ? 0.0 : 4 * next());
    const PostProcessed out = run(extruded(heights, 6, 1), Plane());
    double held = 0;
    for (const RidgeSection& section : out.sections) held += section.excess();
    EXPECT_LE(held, out.excess_length + 1e-9);
    EXPECT_LE(out.ridge_height, ridge_height_of_excess(out.excess_length, 0.3) + 1e-9);
    for (const double gap : out.gaps) EXPECT_GE(gap, kBase);
  }
}

TEST(PostProcessShapes, AtTheNetsBorderTakesTheOneSide) {
  const double spacing = 7;
  const PostProcessed out = run(extruded({0, 0, 1.5, 4}, spacing, 1), Plane());  // the free end is the highest
  ASSERT_EQ(ridge_nodes(out), (std::vector<int>{3}));
  EXPECT_EQ(out.sections[0].nodes, (std::vector<int>{1, 2, 3}));
  const auto points = profile({0, 0, 1.5, 4}, spacing);
  EXPECT_NEAR(out.ridge_height, ridge_height_of_excess(2 * spacing - (points[3].x() - points[1].x()), 0.3), 1e-12);

  const PostProcessed cut = run(extruded({0, 4, 1.5}, spacing, 1), Plane());  // the net ends before the foot
  EXPECT_EQ(ridge_nodes(cut), (std::vector<int>{1}));
  EXPECT_EQ(cut.sections[0].nodes, (std::vector<int>{0, 1, 2}));
}

TEST(PostProcessShapes, AHollowThatThePlyBridgesIsNotClosed) {
  // A taut fibre over a hollow cylinder: it is shorter than the mold below it, and stays where it is.
  const double radius = 60, span = 12;
  const double rim = radius - std::sqrt(radius * radius - span * span);
  const TestNet net = make_net(5, 2, [&](int i, int j) { return Eigen::Vector3d(span * (i - 2) / 2.0, 6 * j, rim); });
  const PostProcessed out = run(net, Cylinder(-radius));
  EXPECT_TRUE(ridge_nodes(out).empty());
  for (int j = 0; j < 2; ++j)
    for (int i = 0; i < 5; ++i) {
      const double gap = net.nodes[5 * j + i].z() - Cylinder(-radius).height({net.nodes[5 * j + i].x(), 0});
      EXPECT_EQ(out.is_bridge[5 * j + i], i > 0 && i < 4);
      EXPECT_NEAR(out.gaps[5 * j + i], kBase + (i > 0 && i < 4 ? gap : 0.0), 1e-12);
    }
  EXPECT_NEAR(out.bridge_height, kBase + rim, 1e-12);
  EXPECT_EQ(out.excess_length, 0.0);
}

TEST(PostProcessShapes, ARidgeAcrossAHollowIsARidge) {
  // Its crest is shorter than the mold below it, offset to the hollow's inside; the fibres that cross it have ply to spare.
  const double radius = 400, spacing = 8;
  const auto points = profile({0, 0, 3, 0, 0}, spacing);
  const TestNet net = make_net(5, 7, [&](int i, int j) {
    const double a = (j - 3) * spacing / radius, r = radius - points[i].y();
    return Eigen::Vector3d(r * std::sin(a), points[i].x(), radius - r * std::cos(a));
  });
  const PostProcessed out = run(net, Cylinder(-radius));
  ASSERT_EQ(out.sections.size(), 7u);
  EXPECT_EQ(out.bridge_height, 0.0);
  EXPECT_NEAR(out.ridge_height, ridge_height_of_excess(2 * (spacing - std::sqrt(spacing * spacing - 9)), 0.3), 1e-9);
}

TEST(PostProcessShapes, ASlightStrainIsNoBridge) {
  TestNet net = extruded({0, 0.02, 0}, 8, 1);
  for (auto& node : net.nodes) node.x() *= 1 + 1e-5;  // feet apart by a little more than the ply is long: a solver's strain
  const PostProcessed out = run(net, Plane());
  EXPECT_EQ(std::accumulate(out.is_bridge.begin(), out.is_bridge.end(), 0), 0);
  EXPECT_EQ(out.rms, kBase);
}

TEST(PostProcessShapes, AFixedBorderNodeAboveTheMoldIsNoRidge) {  // the net accepts up to mold_tol, 0.2 mm, at the foot contour
  const PostProcessed out = run(extruded({0.19, 0, 0, 0.12, 0.2}, 5, 3), Plane());
  EXPECT_TRUE(out.sections.empty());
  EXPECT_EQ(out.rms, kBase);
}

}  // namespace
}  // namespace debulk
