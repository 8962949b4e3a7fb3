#include "debulk/solve/multipliers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/dense.hpp"

namespace debulk {
namespace {

Eigen::MatrixXd random_matrix(int rows, int columns, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd out(rows, columns);
  for (int j = 0; j < columns; ++j)
    for (int i = 0; i < rows; ++i) out(i, j) = normal(engine);
  return out;
}

TEST(Multipliers, AreOptimalWithSignsOnRandomProblems) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Eigen::MatrixXd a = random_matrix(30, 22, seed);
    const Eigen::VectorXd g = random_matrix(30, 1, 1000 + seed);
    std::vector<int> signs;
    for (int k = 10; k < 22; ++k) signs.push_back(k);
    const Multipliers fit = fit_multipliers(a.sparseView(), g, signs);
    EXPECT_LT((g - a * fit.x - fit.residual).norm(), 1e-12);
    const Eigen::VectorXd slope = a.transpose() * fit.residual;
    for (int k = 0; k < 10; ++k) EXPECT_NEAR(slope[k], 0, 1e-8);
    for (const int k : signs) {  // the conditions of non-negative least squares are sufficient
      EXPECT_GE(fit.x[k], 0);
      EXPECT_LE(slope[k], 1e-7);
      EXPECT_NEAR(slope[k] * fit.x[k], 0, 1e-7);
    }
  }
}

TEST(Multipliers, ResidualIsRightForDependentColumns) {
  Eigen::MatrixXd a = random_matrix(20, 12, 7);
  a.col(11) = a.col(2) - 2 * a.col(5);
  a.col(10) = a.col(3);
  const Eigen::VectorXd g = random_matrix(20, 1, 8);
  const Eigen::VectorXd exact = test::least_squares(a, g);
  EXPECT_LT((fit_multipliers(a.sparseView(), g, {}).residual - (g - a * exact)).norm(), 1e-9);
}

// Two contacts with the same gradient share a push in any way, and neither pulls.
TEST(Multipliers, KeepTheirSignsWhereColumnsDependOnEachOther) {
  Eigen::MatrixXd a(3, 3);
  a << 1, 1, 0, 0, 0, 1, 0, 0, 0;
  for (const double push : {2.0, -2.0}) {
    const Multipliers fit = fit_multipliers(a.sparseView(), Eigen::Vector3d(push, 1, 0.5), {0, 1});
    EXPECT_GE(fit.x[0], 0);
    EXPECT_GE(fit.x[1], 0);
    EXPECT_NEAR(fit.x[0] + fit.x[1], std::max(0.0, push), 1e-9);
    EXPECT_NEAR(fit.x[2], 1, 1e-9);
    EXPECT_LT((fit.residual - Eigen::Vector3d(std::min(0.0, push), 0, 0.5)).norm(), 1e-9);
  }
}

// As on a flat net, where contacts and fibres hold each other in many ways: far more columns than forces.
TEST(Multipliers, AreFoundAmongManyWhereColumnsDependOnEachOther) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Eigen::MatrixXd a = random_matrix(30, 20, seed) * random_matrix(20, 90, 100 + seed);
    std::vector<int> signs;
    Eigen::VectorXd known = random_matrix(90, 1, 200 + seed);
    for (int k = 5; k < 90; ++k) {
      signs.push_back(k);
      known[k] = std::max(0.0, known[k]);
    }
    const Eigen::VectorXd g = a * known;
    const Multipliers fit = fit_multipliers(a.sparseView(), g, signs);
    for (const int k : signs) EXPECT_GE(fit.x[k], 0);
    EXPECT_LT(fit.residual.lpNorm<Eigen::Infinity>(), 1e-7 * g.lpNorm<Eigen::Infinity>()) << seed;
  }
}

TEST(Multipliers, AreNotFittedOnceStopped) {
  Stop stop;
  stop.cancel();
  EXPECT_THROW(fit_multipliers(random_matrix(5, 2, 1).sparseView(), random_matrix(5, 1, 2), {}, stop), Stopped);
}

TEST(Multipliers, WithoutColumnsLeaveTheGradient) {
  const Eigen::VectorXd g = random_matrix(5, 1, 3);
  EXPECT_EQ(fit_multipliers(Eigen::SparseMatrix<double>(5, 0), g, {}).residual, g);
}

}  // namespace
}  // namespace debulk
