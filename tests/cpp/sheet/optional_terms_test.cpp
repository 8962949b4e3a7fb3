// Terms that are absent unless asked for, against closed forms (docs/model.md, section 3.1).
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <memory>

#include "debulk/sheet/in_plane_bending.hpp"
#include "debulk/sheet/minimise.hpp"
#include "debulk/sheet/normal_pressure.hpp"
#include "debulk/sheet/tack.hpp"
#include "debulk/sheet/torsion.hpp"
#include "sheet/nets.hpp"

namespace debulk {
namespace {

using Eigen::Vector3d;

double value(const Sheet& sheet, const Points& x, const std::string& name) {
  for (const auto& [term, mj] : sheet.terms(x))
    if (term == name) return mj;
  ADD_FAILURE() << name << " is no term";
  return 0;
}

// A net of columns x rows whose rows turn round the x axis by `twist` per mm: a helicoid.
Net helicoid(int columns, int rows, double spacing, double twist) {
  Net net = test::flat_net(columns, rows, spacing);
  for (Vector3d& p : net.nodes) {
    const double across = p.y() - (rows - 1) * spacing / 2, turn = twist * p.x();
    p = {p.x(), across * std::cos(turn), across * std::sin(turn)};
  }
  return net;
}

TEST(Torsion, OfAStripAboutItsAxisIsExact) {
  const double stiffness = 0.7, spacing = 4.0, twist = 0.05;
  Net net = helicoid(6, 3, spacing, twist);
  for (std::size_t i = 0; i < 18; ++i)  // only the middle one of three fibres goes on along itself
    if (i < 6 || i >= 12) net.neighbours[i][east] = net.neighbours[i][west] = -1;
  const double expected = 5 * stiffness / 2 * std::pow(twist * spacing, 2);  // five segments, seen from both sides
  EXPECT_NEAR(Torsion(stiffness, net.neighbours).value(net.nodes) / expected, 1.0, 1e-10);
}

TEST(Torsion, OfAHelicoidIsTheSquareOfItsTwist) {
  const double stiffness = 0.7, twist = 0.02;
  double before = 1;
  for (const int cells : {4, 8, 16}) {  // the same strip, 20 mm x 40 mm, ever finer
    const double spacing = 20.0 / cells;
    const Net net = helicoid(2 * cells + 1, cells + 1, spacing, twist);
    // At r from the axis the surface turns by twist / (1 + (twist r)^2) per mm, along the helices, which are longer than
    // the net's segments would be, and along the straight lines across them.
    double expected = 0;
    for (int row = 0; row < cells; ++row) {
      const double r = (row + 0.5) * spacing - 10.0, stretch = 1 + std::pow(twist * r, 2);
      expected += stiffness / 2 * std::pow(twist / stretch, 2) * (stretch + 1) * 40.0 * spacing;
    }
    const double error = std::abs(Torsion(stiffness, net.neighbours).value(net.nodes) / expected - 1);
    EXPECT_LT(error, 0.3 * before) << cells;  // second order
    before = error;
  }
  EXPECT_LT(before, 1e-3);
}

TEST(Torsion, IsNoneOfACylinderAlongItsFibresAndTheTwistOfOneAcross) {
  // Rolled on a cylinder round an axis at the angle a to the first fibre: both are twisted by sin 2a / 2R.
  const double stiffness = 0.7, radius = 200.0, spacing = 1.0;
  for (const double angle : {0.0, 0.4, M_PI / 4}) {
    Net net = test::flat_net(11, 11, spacing);
    for (Vector3d& p : net.nodes) {
      const double along = std::cos(angle) * p.x() + std::sin(angle) * p.y(), round = std::cos(angle) * p.y() - std::sin(angle) * p.x();
      p = {along, radius * std::sin(round / radius), radius * std::cos(round / radius)};
    }
    const double turn = std::sin(2 * angle) / (2 * radius);
    EXPECT_NEAR(Torsion(stiffness, net.neighbours).value(net.nodes), stiffness * turn * turn * 100.0,
                1e-4 * stiffness * 100.0 / (radius * radius));
  }
}

// Concentric arcs and their spokes in a plane that is turned in space: only the arcs bend, each by `turn` per spoke.
TEST(InPlaneBending, OfArcsInAPlaneIsHalfBThetaSquared) {
  const double stiffness = 30.0, turn = 0.03;
  const int spokes = 9, arcs = 5;
  Net net = test::flat_net(spokes, arcs, 1.0);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (int j = 0; j < arcs; ++j)
    for (int i = 0; i < spokes; ++i)
      net.nodes[static_cast<std::size_t>(j * spokes + i)] =
          turned * ((30.0 + 2 * j) * Vector3d(std::cos(turn * i), std::sin(turn * i), 0)) + Vector3d(5, 6, 7);
  const double expected = (spokes - 2) * (arcs - 2) * stiffness / 2 * turn * turn;
  EXPECT_NEAR(InPlaneBending(stiffness, net.neighbours).value(net.nodes) / expected, 1.0, 1e-10);
}

TEST(InPlaneBending, IsNoneWhereTheSurfaceAloneBends) {
  const Net roof = test::ridge_net(9, 7, 0.5);  // fibres bent in a vertical plane only
  EXPECT_LT(InPlaneBending(30.0, roof.neighbours).value(roof.nodes), 1e-20);
  Net sheared = test::flat_net(6, 6, 4.0);
  for (Vector3d& p : sheared.nodes) p = {p.x() + 0.4 * p.y(), 0.8 * p.y(), 0.2 * p.x()};
  EXPECT_LT(InPlaneBending(30.0, sheared.neighbours).value(sheared.nodes), 1e-20);
}

TEST(NormalPressure, WorksThroughTheVolumeOfAnInflatedCap) {
  const double pressure = 0.1;
  double before = 1;
  for (const int cells : {10, 20, 40}) {
    const double spacing = 20.0 / cells;
    Net net = test::flat_net(cells + 1, cells + 1, spacing);
    for (Vector3d& p : net.nodes) p -= Vector3d(10, 10, 0);
    const auto cap = [](const Vector3d& p) { return 1.5 * (1 - p.x() * p.x() / 100) * (1 - p.y() * p.y() / 100); };
    Points inflated = net.nodes;
    for (Vector3d& p : inflated) p.z() = cap(p);
    const double volume = 1.5 * std::pow(40.0 / 3, 2);  // 1.5 (integral of 1 - x^2/100 from -10 to 10)^2
    const double error = std::abs(NormalPressure(pressure, net.neighbours, net.nodes).value(inflated) / (pressure * volume) - 1);
    EXPECT_LT(error, 0.3 * before);
    before = error;
  }
  EXPECT_LT(before, 2e-3);
}

TEST(NormalPressure, IsTheVerticalLoadWhileThePlyIsLevelAndFollowsItAsItTilts) {
  const Net net = test::flat_net(5, 4, 4.0);
  const NormalPressure term(0.1, net.neighbours, net.nodes);
  Points raised = net.nodes;
  for (Vector3d& p : raised) p.z() += 3.0;
  EXPECT_NEAR(term.value(raised), 0.1 * 16 * 12 * 3.0, 1e-10);
  Points force(net.nodes.size(), Vector3d::Zero());
  term.add_gradient(net.nodes, force);
  const std::vector<double> areas = nodal_areas(net, Lumping::consistent, 1.0);
  for (std::size_t i = 0; i < force.size(); ++i) EXPECT_LT((force[i] - Vector3d(0, 0, 0.1 * areas[i])).norm(), 1e-12) << i;

  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.6, Vector3d(1, 1, 0).normalized()).toRotationMatrix();
  Net tilted = net;
  for (Vector3d& p : tilted.nodes) p = tilt * p;
  std::fill(force.begin(), force.end(), Vector3d::Zero());
  NormalPressure(0.1, tilted.neighbours, tilted.nodes).add_gradient(tilted.nodes, force);
  for (std::size_t i = 0; i < force.size(); ++i) EXPECT_LT((force[i] - tilt * Vector3d(0, 0, 0.1 * areas[i])).norm(), 1e-12) << i;
}

TEST(NormalPressure, ForcesBalanceAndDoNotDependOnThePlace) {
  Net net = test::flat_net(6, 5, 4.0);
  net.nodes = test::shaken(net.nodes, 0.5, 3);
  net.neighbours[0][east] = net.neighbours[1][west] = -1;  // a ragged rim
  Points x = test::shaken(net.nodes, 2.0, 4), inner = net.nodes;
  for (std::size_t i = 0; i < inner.size(); ++i)
    if (net.inside[i] && i > 8) inner[i] = x[i];  // the rim, ragged at node 7, stays where it was laid
  const auto forces = [&](const Points& start, const Points& at) {
    Points g(at.size(), Vector3d::Zero());
    NormalPressure(0.1, net.neighbours, start).add_gradient(at, g);
    return g;
  };
  const auto sum = [](const Points& g) {
    Vector3d out = Vector3d::Zero();
    for (const Vector3d& f : g) out += f;
    return out;
  };
  const Points here = forces(net.nodes, x), start = forces(net.nodes, net.nodes);
  EXPECT_LT((sum(forces(net.nodes, inner)) - sum(start)).norm(), 1e-12);  // pressure times the area as laid
  Points moved = x, moved_start = net.nodes;
  for (Vector3d& p : moved) p += Vector3d(30, -20, 50);
  for (Vector3d& p : moved_start) p += Vector3d(30, -20, 50);
  const Points there = forces(moved_start, moved);
  for (std::size_t i = 0; i < here.size(); ++i) EXPECT_LT((there[i] - here[i]).norm(), 1e-12);

  Net mirrored = net;  // the second fibre to the right of the first: the pressure still acts from above
  for (Neighbours& n : mirrored.neighbours) std::swap(n[north], n[south]);
  Points g(x.size(), Vector3d::Zero());
  NormalPressure(0.1, mirrored.neighbours, net.nodes).add_gradient(x, g);
  for (std::size_t i = 0; i < here.size(); ++i) EXPECT_LT((g[i] - here[i]).norm(), 1e-12);
}

TEST(Tack, OfAPlateLiftedFromItsSpringsIsHalfKAHSquared) {
  Net net = test::flat_net(5, 5, 4.0, false);  // 256 mm2, all of it free to move
  PlyMaterial ply;
  ply.tack_n_mm3 = 0.3;
  const auto mold = std::make_shared<test::Plane>();
  Points lifted = net.nodes, rows = net.nodes;
  for (Vector3d& p : lifted) p.z() = 1.5;
  EXPECT_NEAR(value(Sheet(net, 256.0, ply, mold), lifted, "tack"), 0.3 / 2 * 256 * 1.5 * 1.5, 1e-10);
  for (std::size_t i = 0; i < 10; ++i) {
    net.nodes[i].z() = 0.3;  // two rows do not lie on the mold, and do not stick
    rows[i].z() = 5.0;
  }
  EXPECT_EQ(value(Sheet(net, 256.0, ply, mold), rows, "tack"), 0.0);
  for (Vector3d& p : net.nodes) p.z() = 0.3;
  EXPECT_EQ(Sheet(net, 256.0, ply, mold).left_out().back(), "tack");
}

PlyMaterial with(const std::string& term) {
  PlyMaterial ply;
  if (term == "torsion") ply.torsion_n_mm = 0.4;
  if (term == "in_plane_bending") ply.in_plane_bending_n_mm = 30;
  if (term == "tack") ply.tack_n_mm3 = 0.1;
  if (term == "normal pressure") ply.pressure_direction = PressureDirection::normal;
  return ply;
}

TEST(OptionalTerms, AreAbsentUnlessAskedFor) {
  const auto sheet = [](const PlyMaterial& ply) { return Sheet(test::ridge_net(9, 7, 0.5), 900.0, ply, std::make_shared<test::Plane>()); };
  EXPECT_EQ(sheet(PlyMaterial()).terms(sheet(PlyMaterial()).start()).size(), 5u);
  for (const char* name : {"torsion", "in_plane_bending"}) {
    EXPECT_EQ(sheet(with(name)).terms(sheet(with(name)).start()).back().first, name);
    EXPECT_EQ(sheet(with(name)).left_out().size(), 3u);
  }
  for (double PlyMaterial::* wrong : {&PlyMaterial::torsion_n_mm, &PlyMaterial::in_plane_bending_n_mm, &PlyMaterial::tack_n_mm3}) {
    PlyMaterial ply;
    ply.*wrong = -1;
    EXPECT_THROW(sheet(ply), InputError);
  }
  const Net fibre = test::chain({{0, 0, 0}, {4, 0, 0}, {8, 0, 0}}, 1, 4.0);
  EXPECT_THROW(Sheet(fibre, 10.0, with("normal pressure"), std::make_shared<test::Plane>()), InputError);
}

TEST(OptionalTerms, LeaveEveryMinimumCertified) {
  Net net = test::ridge_net(9, 7, 0.5);
  for (std::size_t i = 9; i < 54; i += 9) net.kinds[i] = NodeKind::free;  // one side lies on the mold at the ply's edge
  for (const char* name : {"torsion", "in_plane_bending", "tack", "normal pressure"}) {
    const Sheet sheet(net, 900.0, with(name), std::make_shared<test::Plane>());
    MinimiseOptions options;
    options.starts = 3;
    for (const Minimum& minimum : minimise(sheet, options))
      EXPECT_TRUE(minimum.certified()) << name << ' ' << minimum.certificate.failure();
  }
}

}  // namespace
}  // namespace debulk
