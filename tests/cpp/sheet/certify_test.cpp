#include "debulk/sheet/certify.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "debulk/net/fibre_net.hpp"
#include "debulk/sheet/minimise.hpp"
#include "debulk/surface/moved.hpp"
#include "support/dense.hpp"
#include "support/shapes.hpp"

namespace debulk::certify_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kStiffness = 1e8;

// A pocket: a net laid on a bell over a curved mold, its rim fixed on the mold.
struct Case {
  double height_mm, angle, xx, xy, yy;
  std::shared_ptr<const Surface> mold() const { return std::make_shared<test::Quadric>(xx, xy, yy); }
  PocketNet laid() const {
    constexpr double radius = 40;
    const auto base = mold();
    PocketShape shape;
    shape.angles = {angle, angle + M_PI / 2};
    for (int k = 0; k < 80; ++k)
      shape.outline.emplace_back(0.93 * radius * std::cos(2 * M_PI * k / 80), 0.93 * radius * std::sin(2 * M_PI * k / 80));
    FibreNetOptions options;
    options.node_target = 80;
    return fibre_net(test::Bell(*base, height_mm, radius), *base, shape, options);
  }
  Sheet on_mold(double above) const {
    const PocketNet pocket = laid();
    return Sheet(pocket.net, pocket.area, PlyMaterial(), moved(mold(), {0, 0, above}));
  }
  Sheet sheet() const { return Sheet(laid().net, laid().area, PlyMaterial(), mold()); }
};
const std::vector<Case> kCases = {{6, 0.2, 1 / 8000.0, 0, 1 / 6000.0}, {4, 0.7, -1 / 3000.0, 1 / 5000.0, -1 / 4000.0}, {8, 0.0, 0, 0, 0}};

// Least squares with entries of x that may not be negative (Lawson and Hanson, Solving Least Squares Problems, chapter 23).
VectorXd non_negative_least_squares(const MatrixXd& a, const VectorXd& b) {
  const auto columns = static_cast<std::size_t>(a.cols());
  std::vector<char> in(columns, 0);
  VectorXd x = VectorXd::Zero(a.cols());
  const auto fit = [&] {
    std::vector<long> chosen;
    for (std::size_t k = 0; k < columns; ++k)
      if (in[k]) chosen.push_back(static_cast<long>(k));
    MatrixXd part(a.rows(), static_cast<long>(chosen.size()));
    for (std::size_t k = 0; k < chosen.size(); ++k) part.col(static_cast<long>(k)) = a.col(chosen[k]);
    const VectorXd of_part = test::least_squares(part, b);
    VectorXd out = VectorXd::Zero(a.cols());
    for (std::size_t k = 0; k < chosen.size(); ++k) out[chosen[k]] = of_part[static_cast<long>(k)];
    return out;
  };
  for (std::size_t round = 0; round < 10 * columns; ++round) {
    const VectorXd slope = a.transpose() * (b - a * x);
    long enters = -1;
    for (long k = 0; k < a.cols(); ++k)
      if (!in[static_cast<std::size_t>(k)] && slope[k] > 1e-11 * b.norm() && (enters < 0 || slope[k] > slope[enters])) enters = k;
    if (enters < 0) break;
    in[static_cast<std::size_t>(enters)] = 1;
    for (VectorXd next = fit();; next = fit()) {
      double share = 1;
      for (long k = 0; k < a.cols(); ++k)
        if (in[static_cast<std::size_t>(k)] && next[k] <= 0) share = std::min(share, x[k] / (x[k] - next[k]));
      x += share * (next - x);
      if (share == 1) break;
      for (std::size_t k = 0; k < columns; ++k)
        if (in[k] && x[static_cast<long>(k)] <= 1e-15) in[k] = 0;
    }
  }
  return x;
}

// The residual of the certificate by plain formulas and dense matrices: forces of the energy on movable nodes, less tensions of any
// sign along the fibres (with a stiffness: that times the strain) and pushes of the mold under the nodes that touch it.
double plain_residual(const Sheet& sheet, const Points& x, double stiffness = 0) {
  const Net& net = sheet.net();
  std::vector<int> place(x.size(), -1);
  int movable = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (net.kinds[i] != NodeKind::fixed) place[i] = 3 * movable++;
  const Points slope = sheet.gradient(x);
  VectorXd force(3 * movable);
  std::vector<VectorXd> pulls, pushes;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (place[i] >= 0) force.segment<3>(place[i]) = slope[i];
    for (const Direction d : {east, north}) {
      const int j = net.neighbours[i][d];
      if (j < 0 || (place[i] < 0 && place[static_cast<std::size_t>(j)] < 0)) continue;
      const Vector3d along = x[i] - x[static_cast<std::size_t>(j)];
      VectorXd pull = VectorXd::Zero(3 * movable);
      if (place[i] >= 0) pull.segment<3>(place[i]) = along.normalized();
      if (place[static_cast<std::size_t>(j)] >= 0) pull.segment<3>(place[static_cast<std::size_t>(j)]) = -along.normalized();
      const double ratio = along.norm() / net.spacing;
      if (stiffness > 0)  // of k/2 s^2 in units of force unit times spacing, s = (ratio^2 - 1) / 2
        pulls.emplace_back(stiffness * sheet.force_unit_n() * (ratio * ratio - 1) / 2 * ratio * pull);
      else
        pulls.push_back(pull);
    }
    const SurfaceSample mold = sheet.mold().sample(x[i].head<2>());
    if (place[i] >= 0 && x[i].z() - mold.height <= 1e-3) {
      VectorXd push = VectorXd::Zero(3 * movable);
      push.segment<3>(place[i]) << -mold.gradient, 1.0;
      pushes.push_back(push);
    }
  }
  const auto matrix = [&](const std::vector<VectorXd>& columns) {
    MatrixXd out(3 * movable, static_cast<long>(columns.size()));
    for (std::size_t k = 0; k < columns.size(); ++k) out.col(static_cast<long>(k)) = columns[k];
    return out;
  };
  MatrixXd push = matrix(pushes);
  if (stiffness > 0) {
    force += matrix(pulls).rowwise().sum();
  } else {  // tensions take what lies along the fibres; of the mold's pushes, too
    const MatrixXd along = matrix(pulls);
    force -= along * test::least_squares(along, force);
    if (!pushes.empty()) push -= along * test::least_squares(along, push);  // Eigen solves no system of no columns
  }
  if (!pushes.empty()) force -= push * non_negative_least_squares(push, force);
  return force.lpNorm<Eigen::Infinity>() / sheet.force_unit_n();
}

void expect_same_residual(const Sheet& sheet, const Points& x, const char* what) {
  const Certificate at = certify(sheet, x, kStiffness).certificate;
  const double plain = plain_residual(sheet, x, at.compliant ? kStiffness : 0);
  EXPECT_NEAR(at.kkt_error, plain, 1e-7 * plain + 1e-8) << what;
}

// Solved and certified minima, one a case.
class CertifyMinima : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    for (const Case& c : kCases) minima().push_back(minimise(c.sheet(), MinimiseOptions())[0]);
  }
  static void TearDownTestSuite() { minima().clear(); }
  static std::vector<Minimum>& minima() {
    static std::vector<Minimum> of_cases;
    return of_cases;
  }
  template <class Check>
  static void each(const Check& check) {
    for (std::size_t k = 0; k < kCases.size(); ++k) {
      SCOPED_TRACE(k);
      check(kCases[k], minima()[k].nodes);
    }
  }
};

TEST_F(CertifyMinima, PassATrueMinimum) {
  for (const Minimum& minimum : minima()) {
    EXPECT_EQ(minimum.status, SolveStatus::converged);
    EXPECT_TRUE(minimum.certified()) << minimum.certificate.failure();
    EXPECT_FALSE(minimum.certificate.compliant);
  }
  each([](const Case& c, const Points& x) {
    const Sheet sheet = c.sheet();
    const Certificate again = certify(sheet, x, kStiffness).certificate;
    EXPECT_TRUE(again.certified()) << again.failure();
    EXPECT_LT(plain_residual(sheet, x), Certificate::kkt_limit);
    int touching = 0;
    const std::vector<double> gaps = sheet.gaps(x);
    for (const int node : sheet.movable()) touching += gaps[static_cast<std::size_t>(node)] < 1e-3;
    EXPECT_GT(touching, 3);  // contacts are a part of what is judged here
  });
}

TEST_F(CertifyMinima, AgreeWithPlainFormulasWhereverTheyAreAsked) {
  each([](const Case& c, const Points& x) {
    const Sheet sheet = c.sheet();
    expect_same_residual(sheet, sheet.start(), "initial net");
    expect_same_residual(sheet, x, "minimum");
    for (const double amplitude : {1e-5, 1e-4, 2e-4, 1e-3, 2e-3}) {  // also lengths off by more than the plain limit
      Points off = test::shaken(x, amplitude, 17);
      for (std::size_t i = 0; i < off.size(); ++i)
        if (sheet.net().kinds[i] == NodeKind::fixed) off[i] = x[i];
      expect_same_residual(sheet, off, "shaken");
    }
  });
}

TEST_F(CertifyMinima, RefuseTheInitialNet) {
  each([](const Case& c, const Points&) {
    const Certificate at = certify(c.sheet(), c.sheet().start(), kStiffness).certificate;
    EXPECT_EQ(at.failure().find("first-order residual"), 0u) << at.failure();
    EXPECT_EQ(at.failure().find(','), std::string::npos) << at.failure();  // nothing else is wrong with it
  });
}

TEST_F(CertifyMinima, RefuseATruncatedSolve) {
  each([](const Case& c, const Points&) {
    // An iteration of NLopt is a whole minimisation: a dozen of them may do.
    for (const auto& [method, iterations] :
         {std::pair{"interior_point", 1}, {"interior_point", 6}, {"ipopt", 1}, {"ipopt", 6}, {"nlopt", 1}, {"nlopt", 3}}) {
      MinimiseOptions options;
      options.method = method;
      options.solve.max_iterations = iterations;
      options.retries = 0;
      const Minimum cut = minimise(c.sheet(), options)[0];
      EXPECT_EQ(cut.status, SolveStatus::iteration_limit) << method << ' ' << iterations;
      EXPECT_FALSE(cut.certificate.certified()) << method << ' ' << iterations;
      EXPECT_GT(std::max(cut.certificate.kkt_error / Certificate::kkt_limit, cut.certificate.length_error / Certificate::length_limit), 10)
          << method << ' ' << iterations;
    }
  });
}

// The same nodes over a mold that is a little lower: what was pressed on it hangs in the air, and nothing holds it up.
TEST_F(CertifyMinima, RefuseNodesLiftedOffThatShouldBePressed) {
  each([](const Case& c, const Points& x) {
    const Sheet lower = c.on_mold(-0.01);
    const Certificate at = certify(lower, x, kStiffness).certificate;
    EXPECT_EQ(at.failure().find("first-order residual"), 0u) << at.failure();
    EXPECT_EQ(at.failure().find(','), std::string::npos) << at.failure();
    EXPECT_GT(at.kkt_error, 0.1);
    expect_same_residual(lower, x, "lifted");
  });
}

TEST_F(CertifyMinima, RefuseNodesInTheMold) {
  each([](const Case& c, const Points& x) {
    const Certificate at = certify(c.on_mold(0.01), x, kStiffness).certificate;
    EXPECT_NEAR(at.penetration_mm, 0.01, 1e-4);
    EXPECT_EQ(at.failure().find("penetration"), 0u) << at.failure();
    EXPECT_EQ(at.failure().find(','), std::string::npos) << at.failure();
    expect_same_residual(c.on_mold(0.01), x, "in the mold");
  });
}

// One node away from its neighbour: a segment longer than a fibre can be, and, where a compliance might allow for it, one whose
// tension nothing balances.
TEST_F(CertifyMinima, RefuseAPulledSegment) {
  each([](const Case& c, const Points& x) {
    const Sheet sheet = c.sheet();
    const auto node = static_cast<std::size_t>(sheet.movable()[sheet.movable().size() / 2]);
    const Vector3d along = (x[node] - x[static_cast<std::size_t>(sheet.net().neighbours[node][south])]).normalized();
    for (const double strain : {3e-4, 5e-3}) {
      Points pulled = x;
      pulled[node] += strain * sheet.net().spacing * along;
      const Certificate at = certify(sheet, pulled, kStiffness).certificate;
      EXPECT_NEAR(at.length_error, strain, 0.1 * strain);
      EXPECT_TRUE(at.compliant);
      EXPECT_NE(at.failure().find("first-order residual"), std::string::npos) << at.failure();
      EXPECT_EQ(at.failure().find("length error") == 0, strain > 1e-3) << at.failure();
      EXPECT_GT(at.kkt_error, 1e3);  // 1e8 times the strain
      expect_same_residual(sheet, pulled, "pulled");
    }
  });
}

// A minimum above the start is not what the vacuum presses the ply to.
TEST_F(CertifyMinima, RefuseAPointAboveTheStart) {
  MinimiseOptions options;
  options.starts = 12;
  options.perturbation = 0.3;
  const Case& c = kCases[2];
  PlyMaterial ply;
  ply.lumping = Lumping::paper;  // a net that begins elsewhere has other cells; the loads are to stay
  std::vector<Minimum> all = minimise(Sheet(c.laid().net, c.laid().area, ply, c.mold()), options);
  all.erase(std::remove_if(all.begin(), all.end(), [](const Minimum& m) { return !m.certified(); }), all.end());
  std::sort(all.begin(), all.end(), [](const Minimum& a, const Minimum& b) { return a.energy_mj < b.energy_mj; });
  ASSERT_GT(all.size(), 1u);
  const Minimum &lowest = all.front(), &highest = all.back();
  ASSERT_GT(highest.energy_mj - lowest.energy_mj, 0.01);
  PocketNet from_lowest = c.laid();
  from_lowest.net.nodes = lowest.nodes;
  const Sheet sheet(from_lowest.net, from_lowest.area, ply, c.mold());
  EXPECT_TRUE(certify(sheet, lowest.nodes, kStiffness).certificate.certified());
  const Certificate at = certify(sheet, highest.nodes, kStiffness).certificate;
  EXPECT_NEAR(at.energy_gain_mj, highest.energy_mj - lowest.energy_mj, 1e-6);  // loads count from the start
  EXPECT_EQ(at.failure().find("energy"), 0u) << at.failure();
  EXPECT_EQ(at.failure().find("curvature"), std::string::npos) << at.failure();
}

}  // namespace
}  // namespace debulk::certify_test
