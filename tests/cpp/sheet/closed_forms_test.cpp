// The checks of docs/model.md, section 3.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "debulk/sheet/bending.hpp"
#include "debulk/sheet/sheet.hpp"
#include "support/dense.hpp"
#include "support/shapes.hpp"

namespace debulk {
namespace {

std::vector<Neighbours> chain(int nodes, bool closed) {
  std::vector<Neighbours> out;
  for (int i = 0; i < nodes; ++i) {
    const int next = closed ? (i + 1) % nodes : (i + 1 < nodes ? i + 1 : -1);
    const int last = closed ? (i + nodes - 1) % nodes : i - 1;
    out.push_back({next, last, -1, -1});
  }
  return out;
}

TEST(Bending, OfAnNGonIsNHalfCThetaSquared) {
  const double c = 0.81;
  for (const int n : {3, 5, 12, 100, 5000}) {
    Points x;
    for (int i = 0; i < n; ++i) x.emplace_back(std::cos(2 * M_PI * i / n), 0.3, std::sin(2 * M_PI * i / n));
    const double theta = 2 * M_PI / n;
    EXPECT_NEAR(Bending(c, chain(n, true)).value(x) / (n * c / 2 * theta * theta), 1.0, 1e-10) << n;
  }
}

TEST(Bending, BucklesAPinnedStripAtEulersDiscreteLoad) {
  // n segments of length l: P = (4 c / l) sin^2(pi / 2n), the smallest P at which Hessian(bending) - P Hessian(shortening)
  // is singular across the strip.
  const double c = 0.81, l = 5.0;
  for (const int n : {2, 3, 8, 40}) {
    Points x;
    for (int i = 0; i <= n; ++i) x.emplace_back(i * l, 0, 0);
    Bending bending(c, chain(n + 1, false));
    BlockMatrix blocks(n + 1, bending.groups());
    bending.add_hessian(x, bending.places(blocks), blocks);
    const Eigen::MatrixXd lower = blocks.lower();
    Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(n - 1, n - 1), shortening = stiffness;
    for (int i = 0; i < n - 1; ++i)
      for (int j = 0; j <= i; ++j) stiffness(i, j) = stiffness(j, i) = lower(3 * (i + 1) + 2, 3 * (j + 1) + 2);
    for (int i = 0; i < n - 1; ++i) {
      shortening(i, i) = 2 / l;
      if (i > 0) shortening(i, i - 1) = shortening(i - 1, i) = -1 / l;
    }
    const Eigen::VectorXd loads = test::eigenvalues(stiffness, shortening);
    const double expected = 4 * c / l * std::pow(std::sin(M_PI / (2 * n)), 2);
    EXPECT_NEAR(loads[0] / expected, 1.0, 1e-9) << n;
  }
}

TEST(Shear, OfAUniformlyShearedNet) {
  const double gamma = 0.37, spacing = 4.0;
  Net net = test::flat_net(6, 5, spacing);
  for (Eigen::Vector3d& p : net.nodes) p = {p.x() + std::sin(gamma) * p.y(), std::cos(gamma) * p.y(), 0};
  const PlyMaterial ply;
  const Sheet sheet(net, 300.0, ply, std::make_shared<test::Plane>());
  const int corners = 4 * 5 * 4;  // four a cell
  const double expected = corners * 0.5 * ply.shear_mpa * spacing * spacing / 4 * ply.thickness_mm * gamma * gamma;
  EXPECT_NEAR(sheet.terms(net.nodes)[1].second / expected, 1.0, 1e-10);
  EXPECT_NEAR(sheet.terms(net.nodes)[0].second, 0.0, 1e-20);
}

TEST(Sheet, SumsItsTermsWithTheirSigns) {
  Net net = test::flat_net(5, 5, 4.0);
  net.kinds[2] = NodeKind::free;
  PlyMaterial ply;
  ply.lumping = Lumping::paper;
  const double area = 250.0;
  const Sheet sheet(net, area, ply, std::make_shared<test::Plane>());
  Points x = net.nodes;
  for (Eigen::Vector3d& p : x) p.z() -= 0.5;
  const auto terms = sheet.terms(x);
  EXPECT_EQ(terms[3].first, "gravity");
  EXPECT_NEAR(terms[3].second, area * ply.thickness_mm * 1048e-9 * 9.81 * 0.5, 1e-12);
  EXPECT_NEAR(terms[4].second, 0.1 * area * 0.5, 1e-12);  // downward movement is positive: the vacuum presses the ply down
  const double eps = 1e-3 * 4.0;
  EXPECT_NEAR(terms[2].second, 0.4 * 0.1 * area / 25 * (std::sqrt(0.25 + eps * eps) - eps), 1e-12);
  EXPECT_NEAR(sheet.energy(x), terms[0].second + terms[1].second + terms[2].second - terms[3].second - terms[4].second, 1e-12);
}

TEST(Sheet, LeavesOutWhatItDoesNotNeed) {
  PlyMaterial ply;
  ply.young_mpa = 0;
  const Sheet sheet(test::flat_net(4, 4, 4.0), 100.0, ply, std::make_shared<test::Plane>());
  EXPECT_EQ(sheet.left_out(), (std::vector<std::string>{"bending", "friction", "torsion", "in_plane_bending", "tack"}));
}

TEST(Sheet, RefusesANetThatIsNoNet) {
  const auto mold = std::make_shared<test::Plane>();
  const Net good = test::flat_net(4, 4, 4.0);
  const auto expect_refused = [&](const Net& net, const char* word) {
    try {
      Sheet(net, 100.0, PlyMaterial(), mold);
      FAIL() << word;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  Net bad = good;
  bad.neighbours[5][east] = 9;
  expect_refused(bad, "does not name it back");
  bad = good;
  bad.neighbours[5][east] = 99;
  expect_refused(bad, "99");
  bad = good;
  bad.nodes[3].x() = std::nan("");
  expect_refused(bad, "node 3");
  bad = good;
  bad.spacing = 0;
  expect_refused(bad, "spacing_mm");
  bad = good;
  bad.kinds.pop_back();
  expect_refused(bad, "kinds");
  EXPECT_THROW(Sheet(good, 0.0, PlyMaterial(), mold), InputError);
  PlyMaterial hollow;
  hollow.thickness_mm = 0;
  EXPECT_THROW(Sheet(good, 100.0, hollow, mold), InputError);
}

}  // namespace
}  // namespace debulk
