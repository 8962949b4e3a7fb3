#include "debulk/solve/method.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>

#include "debulk/solve/elastic.hpp"

namespace debulk {
namespace {

// minimise -sum(y) on the unit sphere with y_last >= 0.9: y_last = 0.9, the others equal.
class OnSphere : public Problem {
 public:
  explicit OnSphere(int n) : n_(n) {}
  int variables() const override { return n_; }
  int equalities() const override { return 1; }
  Eigen::VectorXd start() const override { return Eigen::VectorXd::LinSpaced(n_, 0.1, 1.0); }
  Eigen::VectorXd lower() const override {
    Eigen::VectorXd out = Eigen::VectorXd::Constant(n_, -std::numeric_limits<double>::infinity());
    out[n_ - 1] = 0.9;
    return out;
  }
  double value(const Eigen::VectorXd& y) const override { return -y.sum(); }
  void gradient(const Eigen::VectorXd&, Eigen::Ref<Eigen::VectorXd> out) const override { out.setConstant(-1); }
  void constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const override { out[0] = (y.squaredNorm() - 1) / 2; }
  std::vector<Entry> jacobian_pattern() const override {
    std::vector<Entry> out;
    for (int i = 0; i < n_; ++i) out.push_back({0, i});
    return out;
  }
  void jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const override { values = y; }
  std::vector<Entry> hessian_pattern() const override {
    std::vector<Entry> out;
    for (int i = 0; i < n_; ++i) out.push_back({i, i});
    return out;
  }
  void hessian(const Eigen::VectorXd&, double, const Eigen::VectorXd& lambda, Eigen::Ref<Eigen::VectorXd> values) const override {
    values.setConstant(lambda[0]);
  }

 private:
  int n_;
};

Eigen::VectorXd solution(int n) {
  Eigen::VectorXd y = Eigen::VectorXd::Constant(n, std::sqrt((1 - 0.81) / (n - 1)));
  y[n - 1] = 0.9;
  return y;
}

TEST(Methods, FindAKnownConstrainedMinimum) {
  const OnSphere problem(4);
  for (const std::string& name : method_names()) {
    const Outcome outcome = method(name)(problem, problem.start(), SolveOptions());
    EXPECT_EQ(outcome.status, SolveStatus::converged) << name;
    EXPECT_LT((outcome.y - solution(4)).norm(), 1e-6) << name;
    EXPECT_GT(outcome.iterations, 0);
    EXPECT_GT(outcome.evaluations, 0);
  }
}

TEST(Methods, SayWhenTheyDidNotFinish) {
  const OnSphere problem(4);
  for (const std::string& name : method_names()) {
    SolveOptions hurried;
    hurried.max_iterations = 2;
    EXPECT_EQ(method(name)(problem, problem.start(), hurried).status, SolveStatus::iteration_limit) << name;
    SolveOptions late;
    late.stop.set_deadline(0.0);
    EXPECT_EQ(method(name)(problem, problem.start(), late).status, SolveStatus::deadline) << name;
    SolveOptions cancelled;
    cancelled.stop.cancel();
    EXPECT_EQ(method(name)(problem, problem.start(), cancelled).status, SolveStatus::cancelled) << name;
  }
}

TEST(Methods, MayBeCalledFromManyThreads) {
  const OnSphere problem(20);
  std::vector<Eigen::VectorXd> found(6);
  std::vector<std::thread> threads;
  for (Eigen::VectorXd& y : found) threads.emplace_back([&] { y = method("auto")(problem, problem.start(), SolveOptions()).y; });
  for (std::thread& t : threads) t.join();
  for (const Eigen::VectorXd& y : found) EXPECT_EQ(y, found[0]);
}

TEST(Methods, AreKnownByName) {
  try {
    method("newton");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("\"newton\""), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("\"ipopt\""), std::string::npos);
  }
}

TEST(Methods, ApproachTheInextensibleAnswerAsTheComplianceStiffens) {
  const OnSphere problem(4);
  for (const std::string& name : method_names()) {
    double previous = 5;
    for (const double k : {1e2, 1e4, 1e6}) {
      SolveOptions options;
      options.stiffness = k;
      options.tolerance = 1e-11;  // of violations that go down to 2e-6 themselves
      const Outcome outcome = method(name)(problem, problem.start(), options);
      ASSERT_EQ(outcome.status, SolveStatus::converged) << name;
      Eigen::VectorXd c(1);
      problem.constraints(outcome.y, c);
      // Stationarity of y_0: -1 + k c y_0 = 0, so that the violation is lambda / k.
      EXPECT_NEAR(k * c[0] * outcome.y[0], 1.0, 1e-5) << name;
      EXPECT_LT(c[0], previous / 50) << name;
      previous = c[0];
    }
  }
}

TEST(Elastic, DerivativesAgreeWithFiniteDifferences) {
  const OnSphere problem(3);
  const Elastic elastic(problem, 50.0);
  Eigen::VectorXd y(4), gradient(4), lambda(1);
  y << 0.3, 0.5, 0.9, 0.02;
  lambda << 1.7;
  const auto slope = [&](const Eigen::VectorXd& at) {  // of weight f + lambda c
    Eigen::VectorXd out(4), row(4);
    elastic.gradient(at, out);
    elastic.jacobian(at, row);
    return Eigen::VectorXd(0.4 * out + lambda[0] * row);
  };
  elastic.gradient(y, gradient);
  Eigen::VectorXd row(4), curvature(4), c_up(1), c_down(1);
  elastic.jacobian(y, row);
  elastic.hessian(y, 0.4, lambda, curvature);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(elastic.jacobian_pattern()[static_cast<std::size_t>(i)].column, i);
    EXPECT_EQ(elastic.hessian_pattern()[static_cast<std::size_t>(i)].row, i);
    Eigen::VectorXd up = y, down = y;
    up[i] += 1e-6;
    down[i] -= 1e-6;
    EXPECT_NEAR(gradient[i], (elastic.value(up) - elastic.value(down)) / 2e-6, 1e-7);
    elastic.constraints(up, c_up);
    elastic.constraints(down, c_down);
    EXPECT_NEAR(row[i], (c_up[0] - c_down[0]) / 2e-6, 1e-8);
    EXPECT_NEAR(curvature[i], (slope(up) - slope(down))[i] / 2e-6, 1e-6);  // a diagonal one
  }
  elastic.constraints(elastic.extend(y.head(3)), c_up);  // the slack takes the whole violation
  EXPECT_EQ(c_up[0], 0);
}

}  // namespace
}  // namespace debulk
