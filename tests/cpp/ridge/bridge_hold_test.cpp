// A ply that is too short for a trough bridges it in the model. Whether it does on a part follows from what it pulls with.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "debulk/ridge/bridge_hold.hpp"
#include "debulk/ridge/post_process.hpp"
#include "debulk/sheet/minimise.hpp"
#include "ridge/test_nets.hpp"

namespace debulk {
namespace {

constexpr double kFriction = 0.4, kPressure = 0.1;
constexpr int kColumns = 13, kRows = 5, kMiddle = (kRows / 2) * kColumns + kColumns / 2;

// A trough of radius `mold` along y, spanned from rim to rim by fibres that lie on a circle of radius `ply` through both rims.
struct Trough {
  double mold_radius, ply_radius, half_span;

  PocketNet laid(double way) const {
    PocketNet out;
    const double half = std::asin(half_span / ply_radius), rim = mold_radius - std::sqrt(mold_radius * mold_radius - half_span * half_span);
    const test::TestNet net = test::make_net(kColumns, kRows, [&](int i, int j) -> Eigen::Vector3d {
      const double angle = half * (2.0 * i / (kColumns - 1) - 1);
      const double z = rim + ply_radius * (std::cos(half) - std::cos(angle));
      return {ply_radius * std::sin(angle), j * spacing(), z};
    });
    out.net.nodes = net.nodes;
    out.net.neighbours = net.neighbours;
    out.net.inside = net.inside;
    out.net.spacing = spacing();
    for (int k = 0; k < kColumns * kRows; ++k)
      out.net.kinds.push_back(k % kColumns == 0 || k % kColumns == kColumns - 1 ? NodeKind::fixed : NodeKind::inner);
    out.area = kColumns * kRows * spacing() * spacing();
    out.hold_ways.assign(out.net.nodes.size(), {way, way});
    return out;
  }
  double spacing() const { return 2 * ply_radius * std::sin(std::asin(half_span / ply_radius) / (kColumns - 1)); }
  std::shared_ptr<const Surface> mold() const { return std::make_shared<test::Cylinder>(-mold_radius); }

  Minimum minimum() const {
    const Sheet sheet(laid(0).net, laid(0).area, PlyMaterial(), mold());
    return minimise(sheet, MinimiseOptions())[0];
  }
  PostProcessed debulked(const Minimum& minimum, double way) const {
    return post_process(minimum.nodes, laid(way).net.neighbours, laid(way).net.inside, *mold(), RidgeOptions(),
                        bridge_hold(laid(way), minimum.tensions_n, kFriction, kPressure));
  }
};

// Of 150 mm radius, where a ply that pulls with P times its own radius can be held; and nearly flat, where it cannot.
const Trough kTight{150, 200, 40}, kWide{2000, 4000, 70};

double gap_in_the_middle(const Trough& trough) {
  const auto sag = [&](double radius) { return radius - std::sqrt(radius * radius - trough.half_span * trough.half_span); };
  return sag(trough.mold_radius) - sag(trough.ply_radius);
}

TEST(BridgeHold, ATautFibresTensionIsThePressureTimesItsRadius) {
  for (const Trough& trough : {kTight, kWide}) {
    const Minimum minimum = trough.minimum();
    ASSERT_TRUE(minimum.certified()) << minimum.certificate.failure();
    const BridgeHold hold = bridge_hold(trough.laid(100), minimum.tensions_n, kFriction, kPressure);
    EXPECT_NEAR(hold.tension[kMiddle][east] / (kPressure * trough.ply_radius), 1.0, 0.04);  // at the crown, of a load along the arc
    EXPECT_EQ(hold.tension[kMiddle][east], hold.tension[kMiddle + 1][west]);
    EXPECT_NEAR(hold.most[kMiddle][0], 4.0, 1e-12);
  }
}

TEST(BridgeHold, ABridgeOverATightTroughStandsWhereThePlyIsHeld) {
  const Minimum minimum = kTight.minimum();
  const double expected = gap_in_the_middle(kTight) + 0.25;
  for (const double way : {580.0, 400.0}) {  // holds 23.2 N/mm; 16, so that it slips, and then spans 160 mm of radius
    const PostProcessed out = kTight.debulked(minimum, way);
    EXPECT_NEAR(out.bridge_height, expected, 0.05) << way;
    EXPECT_EQ(out.drawn_in_height, 0) << way;
    EXPECT_GT(out.rms, 0.5) << way;
  }
}

TEST(BridgeHold, AndComesDownWhereTheEdgeIsNear) {
  const PostProcessed out = kTight.debulked(kTight.minimum(), 300.0);  // 12 N/mm, less than P R = 15
  EXPECT_EQ(out.bridge_height, 0);
  EXPECT_NEAR(out.drawn_in_height, gap_in_the_middle(kTight) + 0.25, 0.05);
  EXPECT_NEAR(out.drawn_in_pull.tension, 20, 0.6);
  EXPECT_NEAR(out.drawn_in_pull.most, 12, 1e-12);
  EXPECT_EQ(out.rms, 0.25);  // of what is left
  for (std::size_t k = 0; k < out.gaps.size(); ++k) EXPECT_EQ(out.gaps[k], 0.25) << k;
}

TEST(BridgeHold, NoFrictionOfAPlyHoldsABridgeOverAWideHollow) {
  const Minimum minimum = kWide.minimum();
  const PostProcessed drawn = kWide.debulked(minimum, 580.0), pinned = kWide.debulked(minimum, 12000.0);
  EXPECT_GT(gap_in_the_middle(kWide), 0.6);
  EXPECT_EQ(drawn.bridge_height, 0);
  EXPECT_NEAR(drawn.drawn_in_height, gap_in_the_middle(kWide) + 0.25, 0.05);
  EXPECT_NEAR(drawn.drawn_in_pull.tension, 400, 12);
  EXPECT_EQ(drawn.rms, 0.25);
  EXPECT_NEAR(pinned.bridge_height, drawn.drawn_in_height, 1e-12);  // were it not for the friction
  EXPECT_EQ(std::count(pinned.is_bridge.begin(), pinned.is_bridge.end(), 1), std::count(drawn.drawn_in.begin(), drawn.drawn_in.end(), 1));
}

TEST(BridgeHold, WithoutTensionsOrEdgeEveryBridgeCounts) {
  const Minimum minimum = kWide.minimum();
  PocketNet laid = kWide.laid(580);
  EXPECT_TRUE(bridge_hold(laid, {}, kFriction, kPressure).most.empty());
  laid.hold_ways.clear();
  EXPECT_TRUE(bridge_hold(laid, minimum.tensions_n, kFriction, kPressure).most.empty());
  const PostProcessed out = post_process(minimum.nodes, laid.net.neighbours, laid.net.inside, *kWide.mold());
  EXPECT_GT(out.bridge_height, 0.6);
}

TEST(BridgeHold, PullsAWidthOfShearedFibres) {
  // Fibres that cross at 60 degrees lie closer together: the same force of each is more a width.
  PocketNet laid = kTight.laid(100);
  const std::vector<std::array<int, 2>> all = segments(laid.net.neighbours);
  const std::vector<double> forces(all.size(), 10.0);
  for (Eigen::Vector3d& p : laid.net.nodes) p = {p.x() + 0.5 * p.y(), std::sqrt(0.75) * p.y(), 0};
  for (std::size_t k = 0; k < laid.net.nodes.size(); ++k)
    laid.net.nodes[k].x() = (k % kColumns) * laid.net.spacing + 0.5 * (k / kColumns) * laid.net.spacing;
  const BridgeHold hold = bridge_hold(laid, forces, kFriction, kPressure);
  EXPECT_NEAR(hold.tension[kMiddle][east], 10.0 / (laid.net.spacing * std::sqrt(0.75)), 1e-9);
}

}  // namespace
}  // namespace debulk
