#include "debulk/section/balance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "debulk/solve/multipliers.hpp"
#include "debulk/solve/newton_system.hpp"

namespace debulk {
namespace {

constexpr double kLifted = 1e-6;              // a node with a larger gap is lifted; the solver leaves a smaller one at a contact
constexpr double kPushing = 1e-6;             // contacts with more force than this hold their node
constexpr double kHeld = 1e10, kStiff = 1e8;  // stiffness of such contacts, and of lengths

// Returns the curvature of the gap along the ply: the ply's curvature, from its turning angle, less that of the mold.
double gap_curvature(const SectionProblem& problem, const Eigen::Matrix2Xd& line, int i) {
  const Eigen::Vector2d d1 = line.col(i) - line.col(i - 1), d2 = line.col(i + 1) - line.col(i);
  const SectionProfile::Sample mold = problem.mold().at(line(0, i));
  const double of_mold = mold.curvature / std::pow(1 + mold.slope * mold.slope, 1.5);
  return std::atan2(d1.x() * d2.y() - d1.y() * d2.x(), d1.dot(d2)) / problem.energy().node_length(i) - of_mold;
}

// Returns the x at which the ply leaves the mold on one side of the crown. The moment and the gap's curvature are zero
// there and grow linearly towards the crown. Extrapolating the curvature from the first two free nodes is exact for the
// reaction of the last touching nodes, so that the foot does not jump from node to node.
double foot(const SectionProblem& problem, const Eigen::Matrix2Xd& line, const Eigen::VectorXd& y, int outward) {
  int touching = problem.crown() + outward;
  while (problem.place(touching, 1) >= 0 && y[problem.place(touching, 1)] > kLifted) touching += outward;
  const int near = touching - outward, far = near - outward;
  if (problem.place(touching, 1) < 0 || far == problem.crown() || near == problem.crown()) return line(0, touching);
  const double k_near = gap_curvature(problem, line, near), k_far = gap_curvature(problem, line, far);
  if (!(k_far > k_near)) return line(0, touching);
  return line(0, near) - k_near / (k_far - k_near) * (line(0, far) - line(0, near));
}

int count_folds(const SectionProblem& problem, const Eigen::VectorXd& y, double higher_than) {
  int folds = 0;
  bool up = false;
  for (int i = 1; i < problem.nodes() - 1; ++i) {
    const bool was_up = std::exchange(up, y[problem.place(i, 1)] > higher_than);
    folds += up && !was_up;
  }
  return folds;
}

}  // namespace

SectionBalance balance_section(const SectionProblem& problem, const Eigen::VectorXd& y, double touch) {
  const int n = problem.variables(), m = problem.equalities();
  const Eigen::Matrix2Xd line = problem.to_line(y);
  const Eigen::VectorXd lower = problem.lower();
  SectionBalance out;

  Eigen::VectorXd gradient(n), c(m), values(static_cast<long>(problem.jacobian_pattern().size()));
  problem.gradient(y, gradient);
  problem.constraints(y, c);
  problem.jacobian(y, values);
  std::vector<Eigen::Triplet<double>> entries;
  long next = 0;
  for (const auto& [row, column] : problem.jacobian_pattern()) entries.emplace_back(column, row, values[next++]);
  std::vector<int> touching, pushing;
  for (int i = 0; i < n; ++i) {
    out.certificate.penetration_mm = std::max(out.certificate.penetration_mm, lower[i] - y[i]);
    if (y[i] - lower[i] > touch) continue;
    pushing.push_back(m + static_cast<int>(touching.size()));
    entries.emplace_back(i, pushing.back(), 1.0);
    touching.push_back(i);
  }
  Eigen::SparseMatrix<double> columns(n, m + static_cast<long>(touching.size()));
  columns.setFromTriplets(entries.begin(), entries.end());
  const Multipliers fit = fit_multipliers(columns, gradient, pushing);
  const Eigen::VectorXd multipliers = fit.x.head(m);

  const double load = problem.scale() * problem.energy().pressure() * problem.lengths().minCoeff();
  out.certificate.kkt_error = out.certificate.strict_kkt_error = fit.residual.lpNorm<Eigen::Infinity>() / load;
  out.certificate.length_error = c.head(problem.segments()).lpNorm<Eigen::Infinity>();
  out.certificate.compliant = out.certificate.length_error > Certificate::length_limit;

  // The point is a minimum if the Hessian, stiffened along lengths and pushing contacts, has a Cholesky factorisation.
  NewtonSystem system(problem, Stop());
  system.differentiate(y);
  system.assemble(y, -multipliers);
  Eigen::VectorXd held = Eigen::VectorXd::Zero(n);
  for (std::size_t k = 0; k < touching.size(); ++k)
    if (fit.x[pushing[k]] > kPushing) held[touching[k]] = kHeld;
  out.certificate.curvature = system.factor(held, kStiff, 0.0) && !system.convexified() ? 0.0 : -1.0;

  const auto along = [&](int k) {
    return multipliers[k] / problem.scale() * (line(0, k + 1) - line(0, k)) / (problem.lengths()[k] * problem.lengths()[k]);
  };
  out.end_force = (along(0) + along(problem.segments() - 1)) / 2;
  Eigen::Matrix2Xd force;
  problem.energy().gradient(line, force);
  out.guide_force = force(0, problem.crown()) - along(problem.crown() - 1) + along(problem.crown());
  for (int i = 1; i < problem.nodes() - 1; ++i) out.height = std::max(out.height, y[problem.place(i, 1)]);
  out.folds = count_folds(problem, y, out.height / 10);
  out.foot_width = foot(problem, line, y, 1) - foot(problem, line, y, -1);
  return out;
}

}  // namespace debulk
