// Points whose forces and curvatures are known by hand: what a certificate has to say of them, to the digit.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <memory>

#include "debulk/sheet/certify.hpp"
#include "sheet/nets.hpp"
#include "support/dense.hpp"

namespace debulk {
namespace {

using Eigen::Vector3d;

constexpr double kSpacing = 4.0, kStiffness = 1e8, kAloft = 100.0;

// Pressed by force_n a node and by nothing else.
PlyMaterial pressed_only(bool bends) {
  PlyMaterial ply;
  ply.density_kg_m3 = ply.shear_mpa = 0;
  ply.lumping = Lumping::paper;  // the same force on every node, whatever the net
  if (!bends) ply.young_mpa = 0;
  return ply;
}
double area_of(double force_n, std::size_t nodes, const PlyMaterial& ply) {
  return force_n * static_cast<double>(nodes) / ply.pressure_mpa;
}
Sheet pressed(const Net& net, double force_n, bool bends = false, std::shared_ptr<const Surface> mold = std::make_shared<test::Plane>()) {
  return Sheet(net, area_of(force_n, net.nodes.size(), pressed_only(bends)), pressed_only(bends), mold);
}

// A node on a fibre from a fixed one, at this angle from hanging, and this many spacings away.
Points pendulum(double angle, double ratio = 1) {
  const Vector3d pivot(0, 0, kAloft);
  return {pivot, pivot + ratio * kSpacing * Vector3d(std::sin(angle), 0, -std::cos(angle))};
}

TEST(Certify, AHangingPendulumIsAMinimumAndAStandingOneASaddle) {
  const Sheet sheet = pressed(test::chain(pendulum(M_PI), 1, kSpacing), 2.5);
  ASSERT_NEAR(sheet.force_unit_n(), 2.5, 1e-12);
  const Certificate hanging = certify(sheet, pendulum(0), kStiffness).certificate;
  EXPECT_TRUE(hanging.certified()) << hanging.failure();
  EXPECT_LT(hanging.kkt_error, 1e-9);

  const Judged standing = certify(sheet, sheet.start(), kStiffness);
  EXPECT_LT(standing.certificate.kkt_error, 1e-9);  // in equilibrium
  EXPECT_NEAR(standing.certificate.curvature, -1, 1e-6);
  EXPECT_EQ(standing.certificate.failure().find("curvature"), 0u) << standing.certificate.failure();
  ASSERT_EQ(standing.descent.size(), 2u);
  EXPECT_EQ(standing.descent[0], Vector3d::Zero());
  EXPECT_LT(std::abs(standing.descent[1].z()), 1e-4);
  EXPECT_NEAR(standing.descent[1].lpNorm<Eigen::Infinity>(), 1, 1e-12);
}

TEST(Certify, APendulumsResidualIsTheLoadAcrossTheFibre) {
  const Sheet sheet = pressed(test::chain(pendulum(M_PI), 1, kSpacing), 0.7);
  for (double angle = 0.01; angle < 3.1; angle += 0.1) {
    const Certificate at = certify(sheet, pendulum(angle), kStiffness).certificate;
    EXPECT_NEAR(at.kkt_error, std::sin(angle) * std::max(std::abs(std::cos(angle)), std::sin(angle)), 1e-8) << angle;
    EXPECT_EQ(at.failure().find("first-order residual"), 0u) << at.failure();
  }
}

// A fibre pulled longer. By little, its tension is what holds the load. By more than that, it is stiffness times strain, whatever
// the load: of all lengths one is in equilibrium. By still more, it is no inextensible fibre.
TEST(Certify, APulledFibreHoldsAsMuchAsItIsStiff) {
  const Sheet sheet = pressed(test::chain(pendulum(M_PI), 1, kSpacing), 1.3);
  const auto at = [&](double ratio, double stiffness) { return certify(sheet, pendulum(0, ratio), stiffness).certificate; };
  const auto tension = [](double ratio, double stiffness) { return stiffness * (ratio * ratio - 1) / 2 * ratio; };  // in units of the load
  EXPECT_TRUE(at(1.00005, 1e8).certified());
  EXPECT_FALSE(at(1.00005, 1e8).compliant);

  double ratio = 1;
  for (int step = 0; step < 20; ++step) ratio -= (tension(ratio, 2000) - 1) / (2000 * (3 * ratio * ratio - 1) / 2);
  const Certificate strained = at(ratio, 2000);
  EXPECT_NEAR(strained.length_error, 5e-4, 1e-6);
  EXPECT_TRUE(strained.certified()) << strained.failure();
  EXPECT_TRUE(strained.compliant);
  for (const auto& [longer, stiffness] : {std::pair{1.0008, 2e3}, {1.0002, 2e3}, {0.9995, 2e3}, {1.0005, 2e4}, {1.0005, 2e2}}) {
    EXPECT_NEAR(at(longer, stiffness).kkt_error, std::abs(tension(longer, stiffness) - 1), 1e-8) << longer << ' ' << stiffness;
    EXPECT_EQ(at(longer, stiffness).failure().find("first-order residual"), 0u);
  }
  EXPECT_EQ(at(1.002, 250).failure().find("length error"), 0u);
  EXPECT_EQ(at(0.998, 1e8).failure().find("length error"), 0u);
}

// Beside its fixed node on the mold: pressed where it touches, unheld a hair above, and nothing but too deep below.
TEST(Certify, ANodeThatShouldBePressedMayNotBeLiftedNorSink) {
  const auto beside = [](double gap) { return Points{Vector3d::Zero(), {std::sqrt(kSpacing * kSpacing - gap * gap), 0, gap}}; };
  const Sheet sheet = pressed(test::chain(beside(0.1), 1, kSpacing), 1.0);
  for (const double gap : {0.0, 5e-4, 9.9e-4, -5e-4}) {
    const Certificate touching = certify(sheet, beside(gap), kStiffness).certificate;
    EXPECT_TRUE(touching.certified()) << gap << ' ' << touching.failure();
  }
  for (const double gap : {1.1e-3, 2e-3, 1e-2}) {
    const Certificate lifted = certify(sheet, beside(gap), kStiffness).certificate;
    EXPECT_NEAR(lifted.kkt_error, 1 - std::pow(gap / kSpacing, 2), 1e-8) << gap;
    EXPECT_EQ(lifted.failure().find("first-order residual"), 0u) << lifted.failure();
  }
  const Certificate sunk = certify(sheet, beside(-2e-3), kStiffness).certificate;
  EXPECT_EQ(sunk.failure(), "penetration 0.002 mm above 0.001");
}

// A stiff fibre clamped at an angle, its last node on the mold. Clamped downward it presses that node; clamped upward it would
// lift it, with c theta / Delta against the load: beyond that the mold would have to pull.
TEST(Certify, TheMoldMayPushANodeButNotPullIt) {
  const double force = 0.1, c = pressed_only(true).bending_mj();
  for (const double upward : {-0.6, -0.3, -0.05, 0.0, 0.1, 0.4, 0.6, 0.9}) {
    const Points x = {kSpacing * Vector3d(-std::cos(upward), 0, -std::sin(upward)), Vector3d::Zero(), {kSpacing, 0, 0}};
    const Sheet sheet = pressed(test::chain(x, 2, kSpacing), force, true);
    const Certificate at = certify(sheet, x, kStiffness).certificate;
    const double lift = c * upward / kSpacing - force;
    EXPECT_EQ(at.certified(), lift < 0) << upward << ' ' << at.failure();
    EXPECT_NEAR(at.kkt_error, std::max(0.0, lift) / sheet.force_unit_n(), 1e-8) << upward;
    EXPECT_NEAR(at.strict_kkt_error, std::max(0.0, lift) / force, 1e-8) << upward;
  }
}

// A column of links under its load, clamped at its foot: it stands until bending no longer holds it (Euler's column, in links;
// of one link c / Delta). Across the column the energy is u.(K - G) u / 2, in both directions.
TEST(Certify, AColumnStandsUntilItBuckles) {
  for (const int movable : {1, 2, 5, 8}) {
    const double c = pressed_only(true).bending_mj();
    Eigen::MatrixXd bending = Eigen::MatrixXd::Zero(movable, movable), sinking = bending;
    for (int i = 0; i < movable; ++i) {
      Eigen::VectorXd turn = Eigen::VectorXd::Zero(movable), lean = turn;  // at the node below movable node i, and of the link to it
      turn[i] = lean[i] = 1;
      if (i > 0) turn[i - 1] = -2, lean[i - 1] = -1;
      if (i > 1) turn[i - 2] = 1;
      bending += c / (kSpacing * kSpacing) * turn * turn.transpose();
      sinking += (movable - i) / kSpacing * lean * lean.transpose();  // of the loads of the nodes above
    }
    const double critical = test::eigenvalues(bending, sinking)[0];
    if (movable == 1) {
      EXPECT_NEAR(critical, c / kSpacing, 1e-12);
    }
    for (const double share : {0.3, 0.97, 1.03, 1.5}) {
      Points x;
      for (int i = 0; i < movable + 2; ++i) x.emplace_back(0, 0, kAloft + i * kSpacing);
      const Sheet sheet = pressed(test::chain(x, 2, kSpacing), share * critical, true);
      const Judged at = certify(sheet, x, kStiffness);
      EXPECT_LT(at.certificate.kkt_error, 1e-8);
      EXPECT_EQ(at.certificate.certified(), share < 1) << movable << ' ' << share << ' ' << at.certificate.failure();
      const double least = test::eigenvalues(bending - share * critical * sinking)[0];
      EXPECT_NEAR(at.certificate.curvature, std::min(0.0, least * kSpacing / sheet.force_unit_n()), 1e-4 * std::abs(least) * kSpacing)
          << movable;
      EXPECT_EQ(at.descent.empty(), share < 1);
    }
  }
}

// z = slope x + curvature y^2.
struct Groove : Surface {
  double slope, curvature;
  Groove(double s, double c) : slope(s), curvature(c) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    SurfaceSample s;
    s.height = slope * p.x() + curvature * p.y() * p.y();
    s.gradient = {slope, 2 * curvature * p.y()};
    s.hessian(1, 1) = 2 * curvature;
    return s;
  }
};

// A node pushed up a slope by its fibre would slide off to the side, but in a groove that is curved enough to hold it:
// curvature 2 k P cos^2 against P sin / Delta.
TEST(Certify, AGrooveHoldsANodeThatAPlaneLetsSlide) {
  const double tilt = 0.5, force = 1.7, enough = std::sin(tilt) / (2 * kSpacing * std::pow(std::cos(tilt), 2));
  const Points x = {Vector3d::Zero(), kSpacing * Vector3d(std::cos(tilt), 0, std::sin(tilt))};
  for (const double share : {-1.0, 0.0, 0.9, 0.99, 1.01, 3.0}) {
    const Sheet sheet = pressed(test::chain(x, 1, kSpacing), force, false, std::make_shared<Groove>(std::tan(tilt), share * enough));
    const Judged at = certify(sheet, x, kStiffness);
    EXPECT_LT(at.certificate.kkt_error, 1e-8);
    EXPECT_EQ(at.certificate.certified(), share > 1) << share << ' ' << at.certificate.failure();
    EXPECT_NEAR(at.certificate.curvature, std::min(0.0, std::sin(tilt) * (share - 1)), 1e-7) << share;
    if (share < 1) {
      EXPECT_NEAR(std::abs(at.descent[1].y()), 1, 1e-9);
    }
  }
}

// Cells of four nodes, three of them fixed, sheared flat on the mold. The fourth touches without pushing: nothing presses it.
// Where the corner opposite to it is acute, folding the cell along its short diagonal brings two corners nearer to right angles.
Net cells(int count, double corner) {
  Net net;
  net.spacing = kSpacing;
  for (int k = 0; k < count; ++k) {
    const Vector3d a(50.0 * k, 0, 0), b = a + Vector3d(kSpacing, 0, 0), up = kSpacing * Vector3d(std::cos(corner), std::sin(corner), 0);
    for (const Vector3d& p : {a, b, Vector3d(a + up), Vector3d(b + up)}) net.nodes.push_back(p);
    const int n = 4 * k;
    for (const Neighbours& of : {Neighbours{n + 1, -1, n + 2, -1}, {-1, n, n + 3, -1}, {n + 3, -1, -1, n}, {-1, n + 2, -1, n + 1}})
      net.neighbours.push_back(of);
    for (const NodeKind kind : {NodeKind::fixed, NodeKind::fixed, NodeKind::fixed, NodeKind::inner}) net.kinds.push_back(kind);
    for (int i = 0; i < 4; ++i) net.inside.push_back(1);
  }
  return net;
}

TEST(Certify, ANodeThatTouchesWithoutPushingMayRise) {
  const double acute = 75 * M_PI / 180;
  PlyMaterial unpressed;
  unpressed.pressure_mpa = unpressed.density_kg_m3 = 0;
  const auto mold = std::make_shared<test::Plane>();
  for (const int count : {1, 2, 3}) {
    const Sheet sheet(cells(count, acute), 100.0, unpressed, mold);
    const Points& flat = sheet.start();
    const Judged at = certify(sheet, flat, kStiffness);
    EXPECT_LT(at.certificate.kkt_error, 1e-8);
    EXPECT_EQ(at.certificate.failure().find("curvature"), 0u) << at.certificate.failure();
    // Folding by an angle about the diagonal keeps the lengths: the energy's second derivative by the way is the curvature.
    const auto folded = [&](double angle) {
      Points x = flat;
      x[3] = x[1] + Eigen::AngleAxisd(angle, (x[2] - x[1]).normalized()) * (x[3] - x[1]);
      return sheet.energy(x);
    };
    const double turn = 1e-3, way = turn * (flat[3] - flat[0]).norm() / 2;
    const double curvature = (folded(turn) - 2 * folded(0) + folded(-turn)) / (way * way);
    EXPECT_NEAR(at.certificate.curvature, curvature * kSpacing / sheet.force_unit_n(), 1e-4 * std::abs(at.certificate.curvature));
    double highest = 0;
    for (const Vector3d& move : at.descent) {
      EXPECT_GE(move.z(), -1e-9) << "into the mold";
      highest = std::max(highest, move.z());
    }
    EXPECT_NEAR(highest, 1, 1e-9);
  }
}

TEST(Certify, ANodeThatIsPressedMayNotRiseAndAStableCellNeedNot) {
  const auto mold = std::make_shared<test::Plane>();
  PlyMaterial ply;
  EXPECT_TRUE(
      certify(Sheet(cells(2, 75 * M_PI / 180), 100.0, ply, mold), cells(2, 75 * M_PI / 180).nodes, kStiffness).certificate.certified());
  ply.pressure_mpa = ply.density_kg_m3 = 0;
  EXPECT_TRUE(
      certify(Sheet(cells(2, 105 * M_PI / 180), 100.0, ply, mold), cells(2, 105 * M_PI / 180).nodes, kStiffness).certificate.certified());
}

}  // namespace
}  // namespace debulk
