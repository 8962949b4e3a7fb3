// What acts on areas is shared out so that its sum does not depend on the net.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <memory>
#include <numeric>

#include "debulk/net/fibre_net.hpp"
#include "debulk/sheet/sheet.hpp"
#include "sheet/nets.hpp"

namespace debulk::lumping_test {
namespace {

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

double term(const Sheet& sheet, const Points& x, const char* name) {
  for (const auto& [called, value] : sheet.terms(x))
    if (called == name) return value;
  return std::nan("");
}

Points pressed(const Net& net, double by) {
  Points x = net.nodes;
  for (Eigen::Vector3d& p : x) p.z() -= by;
  return x;
}

TEST(Lumping, ANodeHasAQuarterOfEachAdjoiningCell) {
  const double d = 4, crossing = 1.1, cell = d * d * std::sin(crossing);
  Net net = test::flat_net(6, 5, d);
  for (Eigen::Vector3d& p : net.nodes) p = {p.x() + std::cos(crossing) * p.y(), std::sin(crossing) * p.y(), 0.2 * p.x()};
  for (Eigen::Vector3d& p : net.nodes) p.x() *= std::sqrt(1 - 0.04);  // the first fibre climbs, one spacing a segment
  const std::vector<double> areas = nodal_areas(net, Lumping::consistent, 1.0);
  const Eigen::Vector3d a = net.nodes[1] - net.nodes[0], b = net.nodes[6] - net.nodes[0];
  const double tilted = a.cross(b).norm();  // of the cell as it lies, not of its projection
  EXPECT_NE(tilted, cell);
  EXPECT_NEAR(areas[7], tilted, 1e-12);      // an inner node: four quarters
  EXPECT_NEAR(areas[1], tilted / 2, 1e-12);  // at a side
  EXPECT_NEAR(areas[0], tilted / 4, 1e-12);  // at a corner
  EXPECT_NEAR(sum(areas), 5 * 4 * tilted, 1e-10);
  EXPECT_NEAR(sum(nodal_areas(net, Lumping::paper, 250.0)), 250.0, 1e-10);
}

TEST(Lumping, ASingleFibreSharesTheGivenAreaEvenly) {
  const Net fibre = test::chain({{0, 0, 0}, {4, 0, 0}, {8, 0, 0}, {12, 0, 0}}, 1, 4.0);
  EXPECT_EQ(nodal_areas(fibre, Lumping::consistent, 60.0), std::vector<double>(4, 15.0));
}

TEST(Lumping, AFreeNodeGripsOutToThePlysEdge) {
  Net net = test::flat_net(4, 4, 5.0);
  EXPECT_EQ(gripping_areas(net, {3}, Lumping::consistent, 1.0), std::vector<double>{12.5});  // half a spacing
  net.to_edge.assign(16, 8.0);
  EXPECT_EQ(gripping_areas(net, {3, 7}, Lumping::consistent, 1.0), std::vector<double>(2, 40.0));
  EXPECT_EQ(gripping_areas(net, {3, 7}, Lumping::paper, 160.0), std::vector<double>(2, 10.0));
}

TEST(Lumping, TheSheetsForcesAreThoseOfTheAreas) {
  Net net = test::flat_net(5, 5, 4.0);
  net.kinds[2] = NodeKind::free;
  net.to_edge.assign(25, 3.0);
  const PlyMaterial ply;
  const Sheet sheet(net, 1.0, ply, std::make_shared<test::Plane>());
  const double weight = ply.thickness_mm * 1048e-9 * 9.81, eps = 1e-3 * 4;
  EXPECT_NEAR(sheet.nodal_force_n(), 0.1 * 16, 1e-14);
  EXPECT_NEAR(sum(sheet.loads_n()), (0.1 + weight) * 16 * 16, 1e-12);
  EXPECT_NEAR(term(sheet, pressed(net, 0.5), "vacuum"), 0.1 * 256 * 0.5, 1e-12);
  EXPECT_NEAR(term(sheet, pressed(net, 0.5), "gravity"), weight * 256 * 0.5, 1e-14);
  EXPECT_NEAR(term(sheet, pressed(net, 0.5), "friction"), 0.4 * 0.1 * 4 * 3 * (std::sqrt(0.25 + eps * eps) - eps), 1e-12);
  EXPECT_NEAR(sheet.grip_n(), 0.4 * 0.1 * 4 * 3, 1e-14);
}

TEST(Lumping, RefusesWaysThatAreNone) {
  Net net = test::flat_net(4, 4, 5.0);
  const auto mold = std::make_shared<test::Plane>();
  net.to_edge = {1.0, 2.0};
  EXPECT_THROW(Sheet(net, 1.0, PlyMaterial(), mold), InputError);
  net.to_edge.assign(16, -1.0);
  EXPECT_THROW(Sheet(net, 1.0, PlyMaterial(), mold), InputError);
}

// A pocket beside the ply's edge at x = 50, which runs along y and is free there, laid at several spacings.
struct Pocket {
  test::Plane mold;
  test::Bell ply{mold, 6.0, 40.0};
  Net laid(double spacing) const {
    PocketShape shape;
    shape.angles = {0.2, 0.2 + M_PI / 2};
    for (int k = 0; k < 72; ++k) shape.outline.emplace_back(40 * std::cos(k * M_PI / 36), 40 * std::sin(k * M_PI / 36));
    shape.ply_outline = {{-300, -300}, {50, -300}, {50, 300}, {-300, 300}};
    FibreNetOptions options;
    options.spacing = spacing;
    return fibre_net(ply, mold, shape, options).net;
  }
};

TEST(Lumping, TheVacuumsWorkDoesNotDependOnTheSpacing) {
  const Pocket pocket;
  // Of pressing every node straight down onto the mold.
  const auto work = [&](double spacing, Lumping lumping) {
    const Net net = pocket.laid(spacing);
    PlyMaterial ply;
    ply.lumping = lumping;
    Points down = net.nodes;
    for (Eigen::Vector3d& p : down) p.z() = 0;
    const double area = M_PI * 1600;  // inside the perimeter; that the ply is 1 % larger matters to neither
    return term(Sheet(net, area, ply, std::make_shared<test::Plane>()), down, "vacuum");
  };
  const double fine = work(1.0, Lumping::consistent);
  double least = 1, most = 1, least_paper = 1, most_paper = 1;
  for (const double spacing : {8.0, 5.0, 3.0, 2.0}) {
    const double now = work(spacing, Lumping::consistent) / fine, paper = work(spacing, Lumping::paper) / fine;
    least = std::min(least, now), most = std::max(most, now);
    least_paper = std::min(least_paper, paper), most_paper = std::max(most_paper, paper);
  }
  EXPECT_LT(most - least, 0.01);
  EXPECT_GT(most_paper - least_paper, 0.2);  // 0.70 to 0.91
}

TEST(Lumping, FrictionDoesNotVanishWithTheSpacing) {
  const Pocket pocket;
  const auto grip = [&](double spacing, Lumping lumping) {
    PlyMaterial ply;
    ply.lumping = lumping;
    return Sheet(pocket.laid(spacing), M_PI * 1600, ply, std::make_shared<test::Plane>()).grip_n();
  };
  // What lies between the free part of the rim, 20 mm and nearer to the edge, and the edge: 50 - x over the arc where x > 30.
  const double half = std::acos(30.0 / 40), strip = 2 * 40 * (50 * half - 40 * std::sin(half));
  for (const double spacing : {5.0, 3.0, 2.0, 1.0})  // a rim of 58 mm has few nodes: their number is a matter of chance
    EXPECT_NEAR(grip(spacing, Lumping::consistent) / (0.4 * 0.1 * strip), 1.0, 0.2) << spacing;
  EXPECT_GT(grip(8.0, Lumping::paper) / grip(1.0, Lumping::paper), 4.0);
}

}  // namespace
}  // namespace debulk::lumping_test
