#include "debulk/sheet/gap_problem.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "support/shapes.hpp"

namespace debulk {
namespace {

class GapProblemOnACurvedMold : public ::testing::Test {
 protected:
  GapProblemOnACurvedMold() {
    net_.kinds[1] = NodeKind::free;
    for (Eigen::Vector3d& p : net_.nodes) p.z() = mold_->height(p.head<2>()) + 0.3;
  }
  Net net_ = test::flat_net(5, 4, 4.0);
  std::shared_ptr<Surface> mold_ = std::make_shared<test::Quadric>(0.01, 0.004, -0.006);
};

TEST_F(GapProblemOnACurvedMold, CoordinatesGoThereAndBack) {
  const Sheet sheet(net_, 200.0, PlyMaterial(), mold_);
  const GapProblem problem(sheet);
  EXPECT_EQ(problem.variables(), 3 * 7);
  const Points x = test::shaken(net_.nodes, 0.2, 3);
  const Points back = problem.to_points(problem.from_points(x));
  for (const int i : sheet.movable()) EXPECT_LT((back[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(i)]).norm(), 1e-12);
  EXPECT_EQ(back[0], net_.nodes[0]);
  for (long k = 2; k < problem.variables(); k += 3) {
    EXPECT_EQ(problem.lower()[k], 0.0);
    EXPECT_NEAR(problem.start()[k], 0.3 / 4.0, 1e-12);
  }
}

// It keeps the energy's Hessian at a point, for other tensions there: to the bit what a problem finds that was never asked before.
TEST_F(GapProblemOnACurvedMold, RemembersNothingOfOtherPointsAndTensions) {
  const Sheet sheet(net_, 200.0, PlyMaterial(), mold_);
  const GapProblem asked(sheet);
  const auto hessian = [](const GapProblem& problem, const Eigen::VectorXd& y, double weight, double tension) {
    Eigen::VectorXd values(static_cast<long>(problem.hessian_pattern().size()));
    problem.hessian(y, weight, Eigen::VectorXd::LinSpaced(problem.equalities(), -tension, tension), values);
    return values;
  };
  for (const unsigned seed : {1u, 2u, 1u}) {
    const Eigen::VectorXd y = asked.from_points(test::shaken(net_.nodes, 0.4, seed));
    for (const auto& [weight, tension] : {std::pair{1.0, 2.0}, {1.0, 0.5}, {0.0, 0.5}, {0.7, 3.0}})
      EXPECT_EQ(hessian(asked, y, weight, tension), hessian(GapProblem(sheet), y, weight, tension))
          << seed << ' ' << weight << ' ' << tension;
  }
}

TEST_F(GapProblemOnACurvedMold, DerivativesAgreeWithFiniteDifferences) {
  const Sheet sheet(net_, 200.0, PlyMaterial(), mold_);
  const GapProblem problem(sheet);
  const int n = problem.variables(), m = problem.equalities();
  const Eigen::VectorXd y = problem.from_points(test::shaken(net_.nodes, 0.4, 11));
  const Eigen::VectorXd lambda = Eigen::VectorXd::LinSpaced(m, -2.0, 3.0);
  const double weight = 0.7, h = 1e-6;

  const auto jacobian = [&](const Eigen::VectorXd& at) {
    const auto pattern = problem.jacobian_pattern();
    Eigen::VectorXd values(static_cast<long>(pattern.size()));
    problem.jacobian(at, values);
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(m, n);
    for (std::size_t k = 0; k < pattern.size(); ++k) out(pattern[k].row, pattern[k].column) += values[static_cast<long>(k)];
    return out;
  };
  const auto slope = [&](const Eigen::VectorXd& at) {
    Eigen::VectorXd g(n);
    problem.gradient(at, g);
    return Eigen::VectorXd(weight * g + jacobian(at).transpose() * lambda);
  };
  const auto pattern = problem.hessian_pattern();
  Eigen::VectorXd values(static_cast<long>(pattern.size()));
  problem.hessian(y, weight, lambda, values);
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    EXPECT_GE(pattern[k].row, pattern[k].column);
    hessian(pattern[k].row, pattern[k].column) += values[static_cast<long>(k)];
    if (pattern[k].row != pattern[k].column) hessian(pattern[k].column, pattern[k].row) += values[static_cast<long>(k)];
  }

  Eigen::VectorXd g(n);
  problem.gradient(y, g);
  const Eigen::MatrixXd j = jacobian(y);
  for (int i = 0; i < n; ++i) {
    Eigen::VectorXd up = y, down = y, c_up(m), c_down(m);
    up[i] += h;
    down[i] -= h;
    EXPECT_NEAR(g[i], (problem.value(up) - problem.value(down)) / (2 * h), 1e-6 * (1 + std::abs(g[i]))) << i;
    problem.constraints(up, c_up);
    problem.constraints(down, c_down);
    EXPECT_LT((j.col(i) - (c_up - c_down) / (2 * h)).cwiseAbs().maxCoeff(), 1e-8) << i;
    EXPECT_LT((hessian.col(i) - (slope(up) - slope(down)) / (2 * h)).cwiseAbs().maxCoeff(), 2e-6 * hessian.cwiseAbs().maxCoeff()) << i;
  }
}

}  // namespace
}  // namespace debulk
