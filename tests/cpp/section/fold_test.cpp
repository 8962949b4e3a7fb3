// The 2-D section model from the inside: energies and the Problem against finite differences and closed forms, and what the
// balance says of configurations that are none. Folds against exact values: tests/python/test_section.py.
#include "debulk/section/fold.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <thread>

#include "debulk/core/error.hpp"
#include "debulk/section/balance.hpp"
#include "debulk/section/energy.hpp"
#include "debulk/section/problem.hpp"
#include "debulk/section/profile.hpp"
#include "debulk/section/start.hpp"

namespace debulk {
namespace {

using Pressure = SectionEnergy::Pressure;

double noise(long k) {
  return std::sin(1.0 + 2.399963 * static_cast<double>(k) * static_cast<double>(k));
}

SectionProfile wavy() {
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i <= 40; ++i) points.emplace_back(-4 + 0.2 * i, 0.3 * std::cos(0.7 * (-4 + 0.2 * i)) + 0.05 * i);
  return SectionProfile(points);
}

// A bump on the profile, with every node a little off: no symmetry, nothing straight.
SectionProblem shaken_problem(const SectionProfile& mold, Pressure pressure, Eigen::VectorXd* y) {
  const SectionStart start = section_start(mold, 3.0, 1.0, 20, 5.0);
  SectionEnergy energy(start.lengths, 1.3, pressure, Eigen::Vector2d(0.2, 0.98));
  energy.set_pressure(0.7);
  SectionProblem problem(mold, start.lengths, start.line, energy, 0.2);
  *y = problem.start();
  for (long i = 0; i < y->size(); ++i) (*y)[i] += 0.03 * noise(i);
  return problem;
}

TEST(SectionProfile, GoesThroughItsPointsSmoothlyAndStraightOnBeyondThem) {
  const SectionProfile profile = wavy();
  EXPECT_NEAR(profile.at(-4 + 0.2 * 7).height, 0.3 * std::cos(0.7 * (-4 + 0.2 * 7)) + 0.05 * 7, 1e-12);
  for (const double x : {-5.0, -4.0, -3.93, -1.2, 0.0, 0.17, 2.9, 4.0, 6.0}) {
    const double h = 1e-5;
    const auto at = profile.at(x), before = profile.at(x - h), after = profile.at(x + h);
    EXPECT_NEAR(at.slope, (after.height - before.height) / (2 * h), 1e-8) << x;
    EXPECT_NEAR(at.curvature, (after.slope - before.slope) / (2 * h), 1e-4) << x;
  }
  EXPECT_NEAR(profile.at(0.5).curvature, -0.3 * 0.49 * std::cos(0.35), 2e-3);
  EXPECT_EQ(profile.at(7.0).curvature, 0.0);
  const SectionProfile line({{-1, 2}, {3, 4}});
  EXPECT_NEAR(line.at(1).height, 3, 1e-15);
  EXPECT_NEAR(line.at(5).height, 5, 1e-15);
}

TEST(SectionEnergy, BendsAnArcAndPressesOnItsArea) {
  const int n = 12;
  const double turn = 0.2, s = 0.3, l = 1.7;
  Eigen::Matrix2Xd arc = Eigen::Matrix2Xd::Zero(2, n + 1);
  for (int k = 0; k < n; ++k) arc.col(k + 1) = arc.col(k) + s * Eigen::Vector2d(std::cos(turn * k), std::sin(turn * k));
  SectionEnergy energy(Eigen::VectorXd::Constant(n, s), l, Pressure::following, {0, 1});
  energy.set_pressure(0.0);
  EXPECT_NEAR(energy.value(arc), (n - 1) * l * l * l * turn * turn / (2 * s), 1e-12);

  Eigen::Matrix2Xd roof(2, 3);
  roof << -2, 0, 2, 0, 1.5, 0;
  SectionEnergy with_area(Eigen::VectorXd::Constant(2, 2.5), 0.0, Pressure::following, {0, 1});
  with_area.set_pressure(0.4);
  EXPECT_NEAR(with_area.value(roof), 0.4 * 3.0, 1e-12);
  SectionEnergy dead(Eigen::VectorXd::Constant(2, 2.5), 0.0, Pressure::vertical, {0, 1});
  EXPECT_NEAR(dead.value(roof), 2.5 * 1.5, 1e-12);
}

class SectionDerivatives : public testing::TestWithParam<Pressure> {};

TEST_P(SectionDerivatives, MatchFiniteDifferencesOnAWavyMold) {
  Eigen::VectorXd y;
  const SectionProblem problem = shaken_problem(wavy(), GetParam(), &y);
  const int n = problem.variables(), m = problem.equalities();
  Eigen::VectorXd lambda(m);
  for (int k = 0; k < m; ++k) lambda[k] = 5 * noise(k + 100);

  Eigen::VectorXd gradient(n), jacobian(static_cast<long>(problem.jacobian_pattern().size())),
      hessian(static_cast<long>(problem.hessian_pattern().size()));
  problem.gradient(y, gradient);
  problem.jacobian(y, jacobian);
  problem.hessian(y, 0.8, lambda, hessian);
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(m, n), h = Eigen::MatrixXd::Zero(n, n);
  long next = 0;
  for (const auto& [row, column] : problem.jacobian_pattern()) j(row, column) += jacobian[next++];
  next = 0;
  for (const auto& [row, column] : problem.hessian_pattern()) {
    EXPECT_GE(row, column);
    h(row, column) += hessian[next];
    if (row != column) h(column, row) += hessian[next];
    ++next;
  }

  const auto slope_at = [&](const Eigen::VectorXd& at) -> Eigen::VectorXd {
    Eigen::VectorXd g(n), v(jacobian.size());
    problem.gradient(at, g);
    problem.jacobian(at, v);
    g *= 0.8;
    long k = 0;
    for (const auto& [row, column] : problem.jacobian_pattern()) g[column] += v[k++] * lambda[row];
    return g;
  };
  const double step = 1e-6;
  for (int i = 0; i < n; ++i) {
    Eigen::VectorXd before = y, after = y, c_before(m), c_after(m);
    before[i] -= step;
    after[i] += step;
    EXPECT_NEAR(gradient[i], (problem.value(after) - problem.value(before)) / (2 * step), 1e-7 * gradient.norm()) << i;
    problem.constraints(before, c_before);
    problem.constraints(after, c_after);
    EXPECT_LT((j.col(i) - (c_after - c_before) / (2 * step)).lpNorm<Eigen::Infinity>(), 1e-7 * j.norm()) << i;
    EXPECT_LT((h.col(i) - (slope_at(after) - slope_at(before)) / (2 * step)).lpNorm<Eigen::Infinity>(), 1e-7 * h.norm()) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Section, SectionDerivatives, testing::Values(Pressure::following, Pressure::vertical),
                         [](const auto& pressure) { return pressure.param == Pressure::following ? "following" : "vertical"; });

TEST(SectionStart, HasTheExcessAndItsLengthsOnAFlatMold) {
  for (const double excess : {0.01, 0.5, 4.0}) {
    const SectionStart start = section_start(SectionProfile(), 3.0, excess, 40, 4.844 * std::pow(excess, 1.0 / 7));
    EXPECT_NEAR(start.lengths.sum(), 6.0 + excess, 1e-12);
    for (int k = 0; k < 40; ++k) EXPECT_NEAR((start.line.col(k + 1) - start.line.col(k)).norm(), start.lengths[k], 1e-9) << k;
    EXPECT_EQ(start.line(0, 20), 0.0);
    EXPECT_NEAR(start.line(0, 40), 3.0, 1e-12);
    EXPECT_GE(start.line.row(1).minCoeff(), 0.0);
  }
}

SectionOptions options_with(int segments, int steps) {
  SectionOptions options;
  options.segments = segments;
  options.steps = steps;
  return options;
}

TEST(Section, ATiltedMoldIsALevelOneUnderPressureThatFollows) {
  const double angle = 0.3, span = 12 * std::cos(angle);
  std::vector<Eigen::Vector2d> slope;
  for (const double x : {-9.0, -2.0, 1.0, 9.0}) slope.emplace_back(x, 5 + std::tan(angle) * x);
  const SectionFold level = fold_section(1, 12, SectionPly(), {}, options_with(100, 2));
  const SectionFold tilted = fold_section(1, span, SectionPly(), slope, options_with(100, 2));
  ASSERT_TRUE(level.certified()) << level.explanation();
  ASSERT_TRUE(tilted.certified()) << tilted.explanation();
  EXPECT_NEAR(tilted.steps.back().height, level.steps.back().height, 1e-6);
  EXPECT_NEAR(tilted.steps.back().end_force, level.steps.back().end_force, 1e-6);
  EXPECT_NEAR(tilted.points[50].x(), -std::sin(angle) * level.steps.back().height, 1e-6);
  EXPECT_NEAR(tilted.guide_force, 0, 1e-6);
}

TEST(Section, AWideCircleIsNearlyFlatAndAMoldOfNoSymmetryNeedsTheGuide) {
  std::vector<Eigen::Vector2d> convex, wave;
  for (int i = 0; i <= 60; ++i) {
    const double x = -9 + 0.3 * i;
    convex.emplace_back(x, std::sqrt(450.0 * 450.0 - x * x) - 450);
    wave.emplace_back(x, 0.05 * std::sin(0.5 * x + 0.6));
  }
  const double flat = fold_section(1, 16, SectionPly(), {}, options_with(100, 1)).steps.back().height;
  const SectionFold on_circle = fold_section(1, 16, SectionPly(), convex, options_with(100, 1));
  const SectionFold on_wave = fold_section(1, 16, SectionPly(), wave, options_with(100, 1));
  ASSERT_TRUE(on_circle.certified()) << on_circle.explanation();
  ASSERT_TRUE(on_wave.certified()) << on_wave.explanation();
  EXPECT_NEAR(on_circle.steps.back().height, flat, 0.02);
  EXPECT_NE(on_circle.steps.back().height, flat);
  EXPECT_NEAR(on_circle.guide_force, 0, 1e-8);
  EXPECT_GT(std::abs(on_wave.guide_force), 1e-5);
}

TEST(Section, TheBalanceRefusesWhatIsNoEquilibrium) {
  const SectionStart start = section_start(SectionProfile(), 4.0, 1.0, 100, 4.844);
  const SectionProblem problem(SectionProfile(), start.lengths, start.line, SectionEnergy(start.lengths, 1.0, Pressure::following, {0, 1}),
                               std::nullopt);
  const Certificate of_start = balance_section(problem, problem.start(), 1e-3).certificate;
  EXPECT_FALSE(of_start.certified());
  EXPECT_GT(of_start.kkt_error, 1.0);
  EXPECT_LT(of_start.length_error, 1e-9);

  Eigen::VectorXd sunk = problem.start();
  sunk[problem.place(3, 1)] -= 0.01;
  EXPECT_NEAR(balance_section(problem, sunk, 1e-3).certificate.penetration_mm, 0.01, 1e-12);

  Eigen::VectorXd stretched = problem.start();
  stretched[problem.place(50, 1)] += 0.05;
  EXPECT_GT(balance_section(problem, stretched, 1e-3).certificate.length_error, 1e-3);
}

// Energy of a fold, mJ per mm, from its points alone.
double energy_of(const SectionFold& fold, double excess, double span, const SectionPly& ply, Pressure pressure) {
  Eigen::Matrix2Xd line(2, static_cast<long>(fold.points.size()));
  for (std::size_t i = 0; i < fold.points.size(); ++i) line.col(static_cast<long>(i)) = fold.points[i];
  const Eigen::VectorXd lengths = Eigen::VectorXd::Constant(line.cols() - 1, (span + excess) / static_cast<double>(line.cols() - 1));
  return ply.pressure * SectionEnergy(lengths, fold.natural_length, pressure, {0, 1}).value(line);
}

TEST(Section, TheEndForceIsTheWorkOfExcessLengthAndOneFoldIsCheaperThanTwo) {
  for (const char* pressure : {"following", "vertical"}) {
    const Pressure kind = std::string(pressure) == "following" ? Pressure::following : Pressure::vertical;
    SectionOptions options = options_with(200, 1);
    options.pressure = pressure;
    const auto energy = [&](double excess) {
      return energy_of(fold_section(excess, 16, SectionPly(), {}, options), excess, 16, SectionPly(), kind);
    };
    const double force = fold_section(1, 16, SectionPly(), {}, options).steps.back().end_force;
    EXPECT_NEAR((energy(1.01) - energy(0.99)) / 0.02, force, 2e-3 * force) << pressure;
    EXPECT_GT(2 * energy(0.5), 1.15 * energy(1)) << pressure;
  }
}

TEST(Section, StopsAndLimitsAreStatusesWithoutFigures) {
  SectionOptions options;
  options.solve.stop.cancel();
  const SectionFold cancelled = fold_section(1, 16, SectionPly(), {}, options);
  EXPECT_EQ(cancelled.status, SolveStatus::cancelled);
  options = SectionOptions();
  options.solve.stop = Stop(0.0);
  const SectionFold late = fold_section(1, 16, SectionPly(), {}, options);
  EXPECT_EQ(late.status, SolveStatus::deadline);
  options = SectionOptions();
  options.solve.max_iterations = 5;
  const SectionFold limited = fold_section(1, 16, SectionPly(), {}, options);
  EXPECT_EQ(limited.status, SolveStatus::iteration_limit);
  for (const SectionFold& fold : {cancelled, late, limited}) {
    EXPECT_FALSE(fold.certified());
    EXPECT_EQ(fold.steps.size(), 1u);
    EXPECT_TRUE(std::isnan(fold.steps.back().height) && std::isnan(fold.steps.back().end_force) && std::isnan(fold.guide_force));
    EXPECT_EQ(fold.points.size(), 201u);
    EXPECT_EQ(fold.explanation(), explanation(fold.status));
  }
}

TEST(Section, GivesTheSameBitsOnEveryThread) {
  const SectionFold alone = fold_section(2.8, 14, SectionPly(), {}, options_with(60, 2));
  std::vector<SectionFold> folds(3);
  std::vector<std::thread> threads;
  for (SectionFold& fold : folds) threads.emplace_back([&fold] { fold = fold_section(2.8, 14, SectionPly(), {}, options_with(60, 2)); });
  for (std::thread& thread : threads) thread.join();
  ASSERT_TRUE(alone.certified()) << alone.explanation();
  for (const SectionFold& fold : folds)
    for (std::size_t i = 0; i < alone.points.size(); ++i) ASSERT_EQ(fold.points[i], alone.points[i]);
}

TEST(Section, NamesWhatIsWrong) {
  const auto message = [](const SectionPly& ply, const SectionOptions& options) -> std::string {
    try {
      fold_section(1, 16, ply, {}, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message({0.0, 0.1}, {}).find("stiffness_n_mm"), 0u);
  EXPECT_EQ(message({0.81, nan}, {}).find("pressure_mpa"), 0u);
  SectionOptions options;
  options.solve.tolerance = 0;
  EXPECT_EQ(message({}, options).find("tolerance"), 0u);
}

}  // namespace
}  // namespace debulk
