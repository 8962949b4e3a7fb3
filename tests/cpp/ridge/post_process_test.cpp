#include "debulk/ridge/post_process.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "debulk/core/error.hpp"
#include "test_nets.hpp"

// One ridge of known excess: its height, length and RMS on flat, tilted and curved molds; then what is refused.
namespace debulk::post_process_test {
namespace {

using test::Cylinder;
using test::extruded;
using test::Plane;
using test::TestNet;

constexpr double kBase = 0.3 / 1.2;

PostProcessed run(const TestNet& net, const Surface& mold, const RidgeOptions& options = {}) {
  return post_process(net.nodes, net.neighbours, net.inside, mold, options);
}

TEST(PostProcess, AFlatNetIsTheConsolidatedPlyToTheBit) {
  const PostProcessed out = run(extruded({0, 0, 0, 0, 0, 0, 0}, 5, 9), Plane());
  for (const double gap : out.gaps) EXPECT_EQ(gap, kBase);
  EXPECT_EQ(out.rms, kBase);
  EXPECT_EQ(out.ridge_height, 0.0);
  EXPECT_EQ(out.ridge_length, 0.0);
  EXPECT_EQ(out.excess_length, 0.0);
  EXPECT_TRUE(out.sections.empty());
}

TEST(PostProcess, ThePapersThirdPocket) {
  const double spacing = 8.40;
  const PostProcessed out = run(extruded({0, 0, 4.66, 0, 0}, spacing, 3), Plane());
  EXPECT_NEAR(out.ridge_height, 1.540, 5e-4);
  ASSERT_EQ(out.sections.size(), 3u);
  for (const RidgeSection& section : out.sections) {
    EXPECT_EQ(section.fibre, 0);
    EXPECT_EQ(section.nodes.size(), 3u);
    EXPECT_NEAR(section.ply_length, 2 * spacing, 1e-12);
    EXPECT_NEAR(section.mold_length, 2 * std::sqrt(spacing * spacing - 4.66 * 4.66), 1e-12);
    EXPECT_NEAR(section.length, spacing, 1e-12);
  }
  EXPECT_NEAR(out.ridge_length, 3 * spacing, 1e-12);
  EXPECT_NEAR(out.excess_length, out.sections[0].excess(), 1e-12);
  EXPECT_NEAR(run(extruded({0, 3.2, 0}, 9.3, 1), Plane()).ridge_height, 0.697, 5e-4);
}

TEST(PostProcess, ClaimsTheFlanksAndTakesTheRmsInside) {
  TestNet net = extruded({0, 2, 4, 2, 0}, 6, 3);
  for (int row = 0; row < 3; ++row) net.inside[5 * row] = net.inside[5 * row + 4] = 0;
  const PostProcessed out = run(net, Plane());
  const double height = out.ridge_height;
  for (int k = 0; k < 15; ++k) {
    EXPECT_EQ(out.is_ridge[k], k % 5 == 2);
    EXPECT_EQ(out.gaps[k], k % 5 == 2 ? height : kBase);
  }
  EXPECT_NEAR(out.rms, std::sqrt((height * height + 2 * kBase * kBase) / 3), 1e-12);
}

TEST(PostProcess, TheSameRidgeOnATiltedMold) {
  const std::vector<double> heights = {0, 0, 1.5, 3.5, 0.5, 0, 0};
  const PostProcessed flat = run(extruded(heights, 7, 4), Plane());
  for (const double turn : {0.0, 0.6, 1.5708})  // across the slope, askew, and down it
    for (const double tilt : {0.1, 0.5}) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() = (Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())).matrix();
      Plane mold;
      const Eigen::Vector3d normal = pose.linear().col(2);
      mold.slope = -normal.head<2>() / normal.z();
      const PostProcessed out = run(extruded(heights, 7, 4, pose), mold);
      EXPECT_NEAR(out.ridge_height, flat.ridge_height, 1e-10);
      EXPECT_NEAR(out.ridge_length, flat.ridge_length, 1e-10);
      EXPECT_NEAR(out.rms, flat.rms, 1e-10);
      EXPECT_NEAR(out.excess_length, flat.excess_length, 1e-10);
      EXPECT_EQ(out.is_ridge, flat.is_ridge);
    }
}

TEST(PostProcess, ARidgeAlongACylinder) {
  const double spacing = 8, peak = 3;
  for (const double radius : {200.0, 1000.0}) {
    // The angle at which a node on the cylinder is one spacing away from the peak above its crown.
    double low = 0, high = spacing / radius;
    const auto at = [&](double a) { return Eigen::Vector3d(radius * std::sin(a), 0, radius * (std::cos(a) - 1)); };
    for (int k = 0; k < 100; ++k) {
      const double mid = (low + high) / 2;
      ((at(mid) - Eigen::Vector3d(0, 0, peak)).norm() < spacing ? low : high) = mid;
    }
    const double step = 2 * std::asin(spacing / 2 / radius);
    const TestNet net = test::make_net(7, 3, [&](int i, int j) -> Eigen::Vector3d {
      const int k = std::abs(i - 3);
      const Eigen::Vector3d p = k == 0 ? Eigen::Vector3d(0, 0, peak) : at((i < 3 ? -1 : 1) * (low + (k - 1) * step));
      return p + Eigen::Vector3d(0, spacing * j, 0);
    });
    const PostProcessed out = run(net, Cylinder(radius));
    const double chords = 2 * 2 * radius * std::sin(low / 2), arc = 2 * radius * low, constant = (2 - std::acos(-1.0) / 2) * 0.3;
    EXPECT_NEAR(out.ridge_height, (2 * spacing - chords) / 2 + constant, 1e-10);
    EXPECT_NEAR(out.ridge_height, (2 * spacing - arc) / 2 + constant, std::pow(spacing, 3) / (24 * radius * radius));
    for (std::size_t k = 0; k < out.gaps.size(); ++k) {
      if (k % 7 != 3) {
        EXPECT_EQ(out.gaps[k], kBase);
      }
    }
  }
}

TEST(PostProcess, ANetFlushWithACylinderHasNoRidge) {
  for (const double radius : {100.0, -100.0}) {
    const double step = 2 * std::asin(10 / 2 / 100.0);
    const PostProcessed out = run(test::make_net(5, 3,
                                                 [&](int i, int j) {
                                                   const double a = (i - 2) * step;
                                                   return Eigen::Vector3d(100 * std::sin(a), 10 * j, radius * (std::cos(a) - 1));
                                                 }),
                                  Cylinder(radius));
    EXPECT_EQ(out.rms, kBase);
    EXPECT_TRUE(out.sections.empty());
  }
}

TEST(PostProcess, TooLittleExcessForARidgeCloses) {
  const PostProcessed out = run(extruded({0, 0.7, 1.4, 0.7, 0}, 8, 3), Plane());
  EXPECT_GT(out.excess_length, 0.1);
  EXPECT_EQ(out.rms, kBase);
  EXPECT_EQ(out.ridge_height, 0.0);
}

TEST(PostProcess, TouchingNodesAreNoRidgesHoweverThickTheyMakeThePly) {
  RidgeOptions options;
  EXPECT_DOUBLE_EQ(options.touch_gap(), 0.01);
  options.touch = 5;
  EXPECT_EQ(run(extruded({0, 0, 4.66, 0, 0}, 8.4, 3), Plane(), options).rms, kBase);
}

TEST(PostProcess, DoesNotDependOnTheNumbersOfTheNodes) {
  const TestNet net = extruded({0, 1, 3.1, 0.4, 2.9, 0}, 6, 4);
  const int count = static_cast<int>(net.nodes.size());
  TestNet shuffled = net;
  const auto number = [count](int old) { return old < 0 ? -1 : (old * 7 + 5) % count; };  // 7 and 24 have no common factor
  for (int k = 0; k < count; ++k) {
    shuffled.nodes[number(k)] = net.nodes[k];
    for (int d = 0; d < 4; ++d) shuffled.neighbours[number(k)][d] = number(net.neighbours[k][d]);
  }
  const PostProcessed a = run(net, Plane()), b = run(shuffled, Plane());
  for (int k = 0; k < count; ++k) EXPECT_EQ(a.gaps[k], b.gaps[number(k)]);
  EXPECT_EQ(a.ridge_length, b.ridge_length);
  EXPECT_EQ(a.excess_length, b.excess_length);
}

TEST(PostProcess, NamesWhatIsWrong) {
  const TestNet good = extruded({0, 2, 0}, 5, 2);
  const auto message = [&good](const std::function<void(TestNet&, RidgeOptions&)>& spoil) -> std::string {
    TestNet net = good;
    RidgeOptions options;
    spoil(net, options);
    try {
      run(net, Plane(), options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message([&](TestNet& n, RidgeOptions&) { n.nodes[4].y() = nan; }).find("node 4"), std::string::npos);
  EXPECT_EQ(message([&](TestNet& n, RidgeOptions&) { n.inside.pop_back(); }).find("inside"), 0u);
  EXPECT_EQ(message([&](TestNet& n, RidgeOptions&) { std::fill(n.inside.begin(), n.inside.end(), 0); }).find("inside"), 0u);
  EXPECT_EQ(message([&](TestNet& n, RidgeOptions&) { n.neighbours.pop_back(); }).find("neighbours"), 0u);
  EXPECT_EQ(message([&](TestNet& n, RidgeOptions&) { n = TestNet(); }).find("inside"), 0u);
  EXPECT_EQ(message([&](TestNet&, RidgeOptions& o) { o.thickness = 0; }).find("thickness_mm"), 0u);
  EXPECT_EQ(message([&](TestNet&, RidgeOptions& o) { o.bulk_factor = 0.9; }).find("bulk_factor"), 0u);
  EXPECT_EQ(message([&](TestNet&, RidgeOptions& o) { o.touch = nan; }).find("touch_mm"), 0u);
}

}  // namespace
}  // namespace debulk::post_process_test
