// Every energy against finite differences, on random, sheared and nearly straight configurations.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "debulk/sheet/angle.hpp"
#include "debulk/sheet/bending.hpp"
#include "debulk/sheet/friction.hpp"
#include "debulk/sheet/in_plane_bending.hpp"
#include "debulk/sheet/load.hpp"
#include "debulk/sheet/normal_pressure.hpp"
#include "debulk/sheet/shear.hpp"
#include "debulk/sheet/tack.hpp"
#include "debulk/sheet/torsion.hpp"
#include "support/shapes.hpp"

namespace debulk::derivatives_test {
namespace {

constexpr double kSpacing = 5.0;

struct Configuration {
  const char* name;
  Points points;
};

std::vector<Configuration> configurations(const Points& flat) {
  Points sheared = flat, folded = flat;
  for (Eigen::Vector3d& p : sheared) p = {p.x() + 0.9 * p.y(), 0.45 * p.y(), 0.1 * p.x()};
  for (std::size_t i = 0; i < folded.size(); ++i) folded[i] += Eigen::Vector3d(0, 0, i % 2 ? 9.0 : 0.0);
  return {{"random", test::shaken(flat, 1.5, 1)},
          {"sheared", test::shaken(sheared, 1e-2, 2)},
          {"nearly straight", test::shaken(flat, 1e-7, 3)},
          {"bent a little", test::shaken(flat, 0.3, 4)},
          {"sharply folded", test::shaken(folded, 0.2, 5)}};
}

// No two forces alike.
std::vector<double> uneven(int count) {
  std::vector<double> out;
  for (int k = 0; k < count; ++k) out.push_back(0.5 + std::fmod(0.618 * k, 1.0));
  return out;
}

Points gradient_of(const Term& term, const Points& x) {
  Points g(x.size(), Eigen::Vector3d::Zero());
  EXPECT_DOUBLE_EQ(term.add_gradient(x, g), term.value(x));
  return g;
}

void expect_derivatives(Term& term, const Points& x, const std::string& what) {
  const int n = static_cast<int>(x.size());
  BlockMatrix hessian(n, term.groups());
  term.add_hessian(x, term.places(hessian), hessian);
  const Eigen::MatrixXd lower = hessian.lower();
  Eigen::MatrixXd full = lower + lower.transpose();
  full.diagonal() -= lower.diagonal();
  for (int k = 0; k < hessian.blocks(); ++k)  // diagonal blocks are symmetric themselves
    if (hessian.row(k) == hessian.column(k)) {
      EXPECT_LT((hessian.block(k) - hessian.block(k).transpose()).norm(), 1e-12 * (1 + hessian.block(k).norm())) << what;
    }

  const Points g = gradient_of(term, x);
  double g_size = 1e-6, h_size = full.cwiseAbs().maxCoeff() + 1e-6;
  for (const Eigen::Vector3d& v : g) g_size = std::max(g_size, v.cwiseAbs().maxCoeff());
  const double step = 1e-5;
  Points moved = x;
  for (std::size_t i = 0; i < x.size(); ++i)
    for (int a = 0; a < 3; ++a) {
      const auto value_at = [&](double h) {
        moved[i][a] = x[i][a] + h;
        return term.value(moved);
      };
      const double e1 = value_at(step), w1 = value_at(-step), e2 = value_at(2 * step), w2 = value_at(-2 * step);
      moved[i] = x[i];
      EXPECT_NEAR(g[i][a], (8 * (e1 - w1) - (e2 - w2)) / (12 * step), 1e-7 * std::max(1.0, g_size)) << what << " gradient, node " << i;
      const auto gradient_at = [&](double h) {
        moved[i][a] = x[i][a] + h;
        return gradient_of(term, moved);
      };
      const Points ge1 = gradient_at(step), gw1 = gradient_at(-step), ge2 = gradient_at(2 * step), gw2 = gradient_at(-2 * step);
      moved[i] = x[i];
      for (std::size_t j = 0; j < x.size(); ++j)
        for (int b = 0; b < 3; ++b)
          EXPECT_NEAR(full(3 * static_cast<long>(j) + b, 3 * static_cast<long>(i) + a),
                      (8 * (ge1[j][b] - gw1[j][b]) - (ge2[j][b] - gw2[j][b])) / (12 * step), 1e-6 * h_size)
              << what << " Hessian, nodes " << j << ", " << i;
    }
}

TEST(Derivatives, OfEveryTermAgreeWithFiniteDifferences) {
  const Net net = test::flat_net(4, 4, kSpacing);
  std::vector<std::pair<std::string, std::unique_ptr<Term>>> terms;
  terms.emplace_back("bending", std::make_unique<Bending>(0.81, net.neighbours));
  terms.emplace_back("shear", std::make_unique<Shear>(40.0, kSpacing, 0.3, net.neighbours));
  terms.emplace_back("load", std::make_unique<Load>(uneven(16), net.nodes));
  terms.emplace_back("friction", std::make_unique<Friction>(uneven(3), kSpacing, std::vector<int>{0, 5, 15}, net.nodes));
  terms.emplace_back("torsion", std::make_unique<Torsion>(0.7, net.neighbours));
  terms.emplace_back("in-plane bending", std::make_unique<InPlaneBending>(30.0, net.neighbours));
  terms.emplace_back(
      "tack", std::make_unique<Tack>(0.3, uneven(3), std::vector<int>{0, 5, 15}, std::make_shared<test::Quadric>(0.02, 0.01, -0.03)));
  terms.emplace_back("normal pressure", std::make_unique<NormalPressure>(0.1, net.neighbours, test::shaken(net.nodes, 1.0, 6)));
  for (auto& [name, term] : terms)
    for (const auto& [configuration, points] : configurations(net.nodes)) expect_derivatives(*term, points, name + ", " + configuration);
}

TEST(Derivatives, TurningIsSmoothWhereTheSeriesTakesOver) {
  for (const double z : {0.009999, 0.010001}) {
    const double d = 25.0, q = z * d * d, h = 1e-4 * q;
    const AngleLaw at = turning_squared(q, d), up = turning_squared(q + h, d), down = turning_squared(q - h, d);
    const double theta = std::atan2(std::sqrt(q), d);
    EXPECT_NEAR(at.value, theta * theta, 1e-15);
    EXPECT_NEAR(at.q, (up.value - down.value) / (2 * h), 1e-8 * at.q);
    EXPECT_NEAR(at.qq, (up.q - down.q) / (2 * h), 1e-6 * std::abs(at.qq));
  }
}

TEST(Derivatives, StraightFibresAndLockedCornersStayFinite) {
  for (const AngleLaw law : {turning_squared(0.0, 25.0), shear_squared(0.0, 25.0), turning_squared(0.0, -25.0)})
    for (const double v : {law.value, law.q, law.d, law.qq, law.qd, law.dd}) EXPECT_TRUE(std::isfinite(v));
  EXPECT_NEAR(shear_squared(0.0, 25.0).value, M_PI * M_PI / 4, 1e-9);
  EXPECT_NEAR(turning_squared(0.0, -25.0).value, M_PI * M_PI, 1e-9);
}

}  // namespace
}  // namespace debulk::derivatives_test
