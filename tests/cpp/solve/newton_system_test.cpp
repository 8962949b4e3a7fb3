#include "debulk/solve/newton_system.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/dense.hpp"

namespace debulk {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::Exact;

// f = y.W y / 2 with a banded W, and equalities a_k.y + (s_k.y)^2 / 2 = 0, each of a few neighbouring variables: like the strain
// of a fibre they have a Hessian without negative curvature, which compression turns into some.
class Banded : public Problem {
 public:
  Banded(int variables, int equalities, int band, double softest, unsigned seed)
      : n_(variables), m_(equalities), band_(band), engine_(seed) {
    w_ = MatrixXd::Zero(n_, n_);
    for (int i = 0; i < n_; ++i)
      for (int j = std::max(0, i - band_); j <= i; ++j) w_(i, j) = w_(j, i) = normal();
    w_ += (softest - test::eigenvalues(w_)[0]) * MatrixXd::Identity(n_, n_);
    for (int k = 0; k < m_; ++k) {
      first_.push_back(static_cast<int>(engine_() % static_cast<unsigned>(n_ - band_)));
      a_.push_back(random_vector(band_ + 1));
      s_.push_back(random_vector(band_ + 1));
    }
  }

  int variables() const override { return n_; }
  int equalities() const override { return m_; }
  VectorXd start() const override { return VectorXd::Zero(n_); }
  VectorXd lower() const override { return VectorXd::Constant(n_, -std::numeric_limits<double>::infinity()); }
  double value(const VectorXd& y) const override { return y.dot(w_ * y) / 2; }
  void gradient(const VectorXd& y, Eigen::Ref<VectorXd> out) const override { out = w_ * y; }
  void constraints(const VectorXd& y, Eigen::Ref<VectorXd> out) const override {
    for (int k = 0; k < m_; ++k) out[k] = of(k, a_).dot(y) + std::pow(of(k, s_).dot(y), 2) / 2;
  }
  std::vector<Entry> jacobian_pattern() const override {
    std::vector<Entry> out;
    for (int k = 0; k < m_; ++k)
      for (int i = 0; i <= band_; ++i) out.push_back({k, first_[static_cast<std::size_t>(k)] + i});
    return out;
  }
  void jacobian(const VectorXd& y, Eigen::Ref<VectorXd> values) const override {
    const MatrixXd dense = dense_jacobian(y);
    long next = 0;
    for (const Entry& e : jacobian_pattern()) values[next++] = dense(e.row, e.column);
  }
  std::vector<Entry> hessian_pattern() const override {
    std::vector<Entry> out;
    for (int i = 0; i < n_; ++i)
      for (int j = std::max(0, i - band_); j <= i; ++j) out.push_back({i, j});
    return out;
  }
  void hessian(const VectorXd&, double weight, const VectorXd& lambda, Eigen::Ref<VectorXd> values) const override {
    const MatrixXd dense = dense_hessian(weight, lambda);
    long next = 0;
    for (const Entry& e : hessian_pattern()) values[next++] = dense(e.row, e.column);
  }

  MatrixXd dense_jacobian(const VectorXd& y) const {
    MatrixXd out(m_, n_);
    for (int k = 0; k < m_; ++k) out.row(k) = of(k, a_) + of(k, s_) * of(k, s_).dot(y);
    return out;
  }
  MatrixXd dense_hessian(double weight, const VectorXd& lambda) const {
    MatrixXd out = weight * w_;
    for (int k = 0; k < m_; ++k) out += lambda[k] * of(k, s_) * of(k, s_).transpose();
    return out;
  }
  void repeat_equality(std::size_t which, std::size_t as) {
    first_[as] = first_[which];
    a_[as] = a_[which];
    s_[as] = s_[which];
  }

  double normal() { return normal_(engine_); }
  VectorXd random_vector(int size) {
    VectorXd out(size);
    for (int i = 0; i < size; ++i) out[i] = normal();
    return out;
  }
  // Of the bounds: three kinds of variables, held by an active bound, near none, and without one.
  VectorXd random_bounds() {
    VectorXd out = VectorXd::Zero(n_);
    for (int i = 0; i < n_; ++i)
      if (const unsigned kind = engine_() % 3; kind > 0) out[i] = (kind == 1 ? 1e7 : 1e-7) * (1 + std::abs(normal()));
    return out;
  }

 private:
  VectorXd of(int k, const std::vector<VectorXd>& values) const {
    VectorXd out = VectorXd::Zero(n_);
    out.segment(first_[static_cast<std::size_t>(k)], band_ + 1) = values[static_cast<std::size_t>(k)];
    return out;
  }
  int n_, m_, band_;
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
  MatrixXd w_;
  std::vector<int> first_;
  std::vector<VectorXd> a_, s_;
};

struct Solution {
  VectorXd dy, dl;
};

// The whole system at once, in long double.
Solution dense_solution(const MatrixXd& w, const MatrixXd& j, double stiffness, const VectorXd& slope, const VectorXd& deficit) {
  const long n = w.rows(), m = j.rows();
  Exact kkt = Exact::Zero(n + m, n + m), right(n + m, 1);
  kkt.topLeftCorner(n, n) = w.cast<long double>();
  kkt.topRightCorner(n, m) = j.transpose().cast<long double>();
  kkt.bottomLeftCorner(m, n) = j.cast<long double>();
  kkt.bottomRightCorner(m, m) = -Exact::Identity(m, m) / static_cast<long double>(stiffness);
  right << slope.cast<long double>(), deficit.cast<long double>();
  const VectorXd both = test::exact_solution(kkt, right);
  return {both.head(n), both.tail(m)};
}

// Of W + S + rho J^T J: what is positive definite is factored as it is.
double least_eigenvalue(const MatrixXd& w, const MatrixXd& j, double rho) {
  return test::eigenvalues(w + rho * j.transpose() * j)[0];
}

TEST(NewtonSystem, SolvesWhatADenseFactorisationSolves) {
  int plain = 0, tension_only = 0, shifted = 0;
  for (unsigned seed = 1; seed <= 42; ++seed)
    for (const double stiffness : {1e3, 1e6, 1e8, 1e10}) {
      const int n = 10 + static_cast<int>(seed) * 2, m = n / 3 + static_cast<int>(seed) % 5;
      Banded problem(n, m, 6, seed % 3 == 0 ? 0.5 : seed % 3 == 1 ? -0.5 : -8.0, seed);
      // Gradients that depend on each other; beyond a stiffness of 1e8 the refinement is not for them (the header says so).
      if (seed % 7 == 0 && stiffness <= 1e8) problem.repeat_equality(0, 1);
      const VectorXd y = 0.3 * problem.random_vector(n), lambda = (seed % 2 == 0 ? 0.5 : 4.0) * problem.random_vector(m);
      const VectorXd bounds = problem.random_bounds(), slope = problem.random_vector(n), deficit = 0.1 * problem.random_vector(m);
      NewtonSystem system(problem, Stop());
      system.differentiate(y);
      system.assemble(y, lambda);
      ASSERT_TRUE(system.factor(bounds, stiffness, 0)) << seed;

      const MatrixXd j = problem.dense_jacobian(y), s = bounds.asDiagonal();
      MatrixXd w = problem.dense_hessian(1, lambda) + s;
      const double least = least_eigenvalue(w, j, std::min(stiffness, 1e8));
      if (std::abs(least) > 1e-4) {
        EXPECT_EQ(system.convexified(), least < 0) << seed << ' ' << least;
      }
      if (system.convexified()) {
        w = problem.dense_hessian(1, lambda.cwiseMax(0)) + s + system.shift() * MatrixXd::Identity(n, n);
        const double without = least_eigenvalue(w - system.shift() * MatrixXd::Identity(n, n), j, std::min(stiffness, 1e8));
        if (std::abs(without) > 1e-4) {
          EXPECT_EQ(system.shift() > 0, without < 0) << seed << ' ' << without;
        }
      } else {
        EXPECT_EQ(system.shift(), 0);
      }
      ++(!system.convexified() ? plain : system.shift() == 0 ? tension_only : shifted);

      VectorXd dy, dl;
      system.solve(slope, deficit, dy, dl);
      const Solution expected = dense_solution(w, j, stiffness, slope, deficit);
      EXPECT_LT((dy - expected.dy).norm(), 1e-7 * expected.dy.norm()) << seed << ' ' << stiffness << ' ' << system.shift();
      EXPECT_LT((dl - expected.dl).norm(), 1e-7 * expected.dl.norm()) << seed << ' ' << stiffness << ' ' << system.shift();
      for (int i = 0; i < n; ++i)
        if (bounds[i] > 1e6) {
          EXPECT_LT(std::abs(dy[i]), 1e-4 * (1 + expected.dl.norm())) << seed;  // an active bound holds
        }
    }
  // All three ways were gone.
  EXPECT_GT(plain, 30);
  EXPECT_GT(tension_only, 10);
  EXPECT_GT(shifted, 30);
}

TEST(NewtonSystem, ShiftsByAsMuchAsItIsTold) {
  Banded problem(30, 8, 5, 0.5, 11);
  const VectorXd y = 0.3 * problem.random_vector(30), lambda = problem.random_vector(8);
  const VectorXd slope = problem.random_vector(30), deficit = problem.random_vector(8), none = VectorXd::Zero(30);
  NewtonSystem system(problem, Stop());
  system.differentiate(y);
  system.assemble(y, lambda);
  ASSERT_TRUE(system.factor(none, 1e6, 0.7));
  EXPECT_TRUE(system.convexified());
  EXPECT_EQ(system.shift(), 0.7);
  EXPECT_EQ(system.last_shift(), 0.7);
  VectorXd dy, dl;
  system.solve(slope, deficit, dy, dl);
  const MatrixXd w = problem.dense_hessian(1, lambda.cwiseMax(0)) + 0.7 * MatrixXd::Identity(30, 30);
  EXPECT_LT((dy - dense_solution(w, problem.dense_jacobian(y), 1e6, slope, deficit).dy).norm(), 1e-9);
}

// Where a quarter of the compression is all that has to be left out, the step is that of the rest.
TEST(NewtonSystem, LeavesOutNoMoreCompressionThanItHasTo) {
  int tried = 0;
  for (unsigned seed = 1; seed <= 20; ++seed)
    for (double push = 0.1; push < 100; push *= 1.2) {
      Banded problem(30, 8, 5, 1.0, seed);
      const VectorXd y = 0.3 * problem.random_vector(30), lambda = -push * problem.random_vector(8).cwiseAbs(), none = VectorXd::Zero(30);
      const MatrixXd j = problem.dense_jacobian(y);
      const auto rest = [&](double share) { return problem.dense_hessian(1, (1 - share) * lambda); };
      const auto least = [&](double share) { return test::eigenvalues(rest(share) + 1e6 * j.transpose() * j)[0]; };
      if (least(0) > -0.01 || least(0.25) < 0.01) continue;
      ++tried;
      NewtonSystem system(problem, Stop());
      system.differentiate(y);
      system.assemble(y, lambda);
      system.spare(true);
      ASSERT_TRUE(system.factor(none, 1e6, 0));
      EXPECT_TRUE(system.convexified());
      const VectorXd slope = problem.random_vector(30), deficit = problem.random_vector(8);
      VectorXd dy, dl;
      system.solve(slope, deficit, dy, dl);
      const VectorXd expected = dense_solution(rest(0.25), j, 1e6, slope, deficit).dy;
      EXPECT_LT((dy - expected).norm(), 1e-6 * expected.norm()) << seed << ' ' << push;
      system.spare(false);
      ASSERT_TRUE(system.factor(none, 1e6, 0));
      system.solve(slope, deficit, dy, dl);
      EXPECT_GT((dy - expected).norm(), 1e-3 * expected.norm()) << seed << ' ' << push;
    }
  EXPECT_GE(tried, 10);
}

TEST(NewtonSystem, MultipliesByTheJacobianBothWays) {
  Banded problem(25, 9, 4, 1.0, 5);
  const VectorXd y = problem.random_vector(25), v = problem.random_vector(25), lambda = problem.random_vector(9);
  NewtonSystem system(problem, Stop());
  system.differentiate(y);
  const MatrixXd j = problem.dense_jacobian(y);
  EXPECT_LT((system.jacobian_times(v) - j * v).norm(), 1e-13 * j.norm() * v.norm());
  EXPECT_LT((system.jacobian_transposed(lambda) - j.transpose() * lambda).norm(), 1e-13 * j.norm() * lambda.norm());
}

TEST(NewtonSystem, FitsMultipliersByLeastSquares) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Banded problem(40, 12, 6, 1.0, seed);
    const VectorXd y = 0.3 * problem.random_vector(40), slope = problem.random_vector(40);
    NewtonSystem system(problem, Stop());
    system.differentiate(y);
    const MatrixXd columns = problem.dense_jacobian(y).transpose();
    const VectorXd expected = test::least_squares(columns, -slope);
    EXPECT_LT((system.fitted_multipliers(slope) - expected).norm(), 1e-5 * expected.norm()) << seed;
  }
}

// Against the least curvature on the null space of the equalities, both found by dense factorisations.
TEST(NewtonSystem, FindsTheSoftestDirectionWithinTheConstraints) {
  int saddles = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const int n = 10 + static_cast<int>(seed % 7) * 15, m = n / 3;
    Banded problem(n, m, 6, seed % 2 == 0 ? -3.0 : -30.0, seed);
    const VectorXd y = 0.3 * problem.random_vector(n), lambda = 0.2 * problem.random_vector(m), bounds = problem.random_bounds();
    NewtonSystem system(problem, Stop());
    system.differentiate(y);
    system.assemble(y, lambda);
    ASSERT_TRUE(system.factor(bounds, 1e8, 0));
    const VectorXd v = system.softest_direction(bounds);
    const MatrixXd j = problem.dense_jacobian(y), w = problem.dense_hessian(1, lambda) + MatrixXd(bounds.asDiagonal());
    const MatrixXd null_space = test::orthogonal(MatrixXd(j.transpose())).rightCols(n - m);
    const double least = test::eigenvalues(null_space.transpose() * w * null_space)[0];
    EXPECT_NEAR(v.norm(), 1, 1e-12);
    EXPECT_LT((j * v).norm(), 1e-4) << seed;
    EXPECT_GE(v.dot(w * v), least - 1e-3) << seed;
    if (least > 0) continue;
    ++saddles;
    EXPECT_LT(v.dot(w * v), 0.99 * least) << seed;
  }
  EXPECT_GE(saddles, 40);
}

// It ends the factorisation that it is at: one that needs no other is had, stop or not.
TEST(NewtonSystem, GivesUpWhenStopped) {
  for (const double softest : {1.0, -50.0}) {
    Banded problem(30, 3, 5, softest, 3);
    Stop stop;
    NewtonSystem system(problem, stop);
    system.differentiate(VectorXd::Zero(30));
    system.assemble(VectorXd::Zero(30), VectorXd::Zero(3));
    stop.cancel();
    EXPECT_EQ(system.factor(VectorXd::Zero(30), 1e6, 0), softest > 0);
  }
}

}  // namespace
}  // namespace debulk
