#include "debulk/solve/newton_system.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Eigenvalues>

namespace debulk {
namespace {

constexpr double kStiffest = 1e8;  // largest rho; beyond it, the factorisation loses the digits of W
constexpr double kShiftFirst = 1e-4, kShiftLeast = 1e-12, kShiftMost = 1e12;
// Shares of the compression that are left out: the least, and how the next to try goes with the last that served.
constexpr double kShareLeast = 1e-6, kShareLess = 4, kShareMore = 8;
constexpr int kRefinements = 6, kLanczosSteps = 15;
constexpr double kRefined = 1e-8;  // of the slope; a residual this small is far below what the next step has to correct

}  // namespace

NewtonSystem::NewtonSystem(const Problem& problem, Stop stop)
    : problem_(problem),
      stop_(std::move(stop)),
      n_(problem.variables()),
      m_(problem.equalities()),
      jacobian_(problem.jacobian_pattern()),
      hessian_(problem.hessian_pattern()),
      j_(static_cast<long>(jacobian_.size())),
      w_(static_cast<long>(hessian_.size())) {
  std::vector<std::pair<int, int>> lower;
  for (const auto& [row, column] : hessian_) lower.emplace_back(row, column);
  std::vector<std::vector<int>> by_row(static_cast<std::size_t>(m_));
  for (std::size_t k = 0; k < jacobian_.size(); ++k) by_row[static_cast<std::size_t>(jacobian_[k].row)].push_back(static_cast<int>(k));
  const auto column = [&](int entry) { return jacobian_[static_cast<std::size_t>(entry)].column; };
  for (const std::vector<int>& row : by_row)
    for (const int a : row)
      for (const int b : row)
        if (column(a) >= column(b)) lower.emplace_back(column(a), column(b));
  factors_ = plain_ = Skyline(n_, lower);
  for (const auto& [row, col] : hessian_) places_.push_back(plain_.place(row, col));
  for (const std::vector<int>& row : by_row)
    for (const int a : row)
      for (const int b : row)
        if (column(a) >= column(b)) products_.push_back({a, b, plain_.place(column(a), column(b))});
}

void NewtonSystem::differentiate(const Eigen::VectorXd& y) {
  problem_.jacobian(y, j_);
}

void NewtonSystem::assemble(const Eigen::VectorXd& y, const Eigen::VectorXd& lambda) {
  problem_.hessian(y, 1.0, lambda, w_);
  y_ = y;
  lambda_ = lambda;
  convex_known_ = false;
}

void NewtonSystem::assemble_convex() {
  if (convex_known_) return;
  convex_.resize(w_.size());
  problem_.hessian(y_, 1.0, lambda_.cwiseMax(0.0), convex_);
  convex_known_ = true;
}

// Assembles W (or its convex part) + sigma + shift, and factorises that matrix + rho J^T J; returns false if it is not
// positive definite.
bool NewtonSystem::try_factor(const Eigen::VectorXd& w, const Eigen::VectorXd& sigma) {
  std::fill(plain_.values().begin(), plain_.values().end(), 0.0);
  for (std::size_t k = 0; k < places_.size(); ++k) plain_.values()[places_[k]] += w[static_cast<long>(k)];
  for (int i = 0; i < n_; ++i) plain_.values()[plain_.diagonal(i)] += sigma[i] + shift_;
  factors_.values() = plain_.values();
  add_normal(rho_);
  return factors_.factor();
}

void NewtonSystem::add_normal(double rho) {
  std::vector<double>& values = factors_.values();
  for (const Product& p : products_) values[p.place] += rho * j_[p.one] * j_[p.other];
}

// Waechter and Biegler's Algorithm IC: tries the shift as it is, then growing shifts, from a third of the last that
// helped.
bool NewtonSystem::shift_until_positive(const Eigen::VectorXd& w, const Eigen::VectorXd& sigma) {
  while (!try_factor(w, sigma)) {
    if (stop_.now()) return false;
    if (shift_ == 0)
      shift_ = last_shift_ == 0 ? kShiftFirst : std::max(kShiftLeast, last_shift_ / 3);
    else
      shift_ *= last_shift_ == 0 ? 100 : 8;
    if (shift_ > kShiftMost) return false;
  }
  if (shift_ > 0) last_shift_ = shift_;
  return true;
}

bool NewtonSystem::factor(const Eigen::VectorXd& sigma, double stiffness, double least_shift) {
  stiffness_ = stiffness;
  rho_ = std::min(stiffness, kStiffest);
  shift_ = least_shift;
  convexified_ = shift_ > 0 || !try_factor(w_, sigma);
  if (!convexified_) return true;
  if (stop_.now()) return false;
  assemble_convex();
  if (sparing_ && shift_ == 0)
    for (share_ = std::max(kShareLeast, share_ / kShareLess); share_ < 1; share_ *= kShareMore) {
      if (try_factor((1 - share_) * w_ + share_ * convex_, sigma)) return true;
      if (stop_.now()) return false;
    }
  share_ = 1;
  return shift_until_positive(convex_, sigma);
}

void NewtonSystem::solve(const Eigen::VectorXd& slope, const Eigen::VectorXd& deficit, Eigen::VectorXd& dy, Eigen::VectorXd& dl) {
  dy.setZero(n_);
  dl.setZero(m_);
  Eigen::VectorXd r1 = slope, r2 = deficit, product;
  double last = std::numeric_limits<double>::infinity();
  const double small = kRefined * std::max(slope.lpNorm<Eigen::Infinity>(), 1e-300);
  for (int round = 0; round <= kRefinements; ++round) {
    Eigen::VectorXd d = r1 + rho_ * jacobian_transposed(r2);
    factors_.solve(d);
    const Eigen::VectorXd e = rho_ * (jacobian_times(d) - r2);
    dy += d;
    dl += e;
    plain_.multiply(dy, product);
    r1 = slope - product - jacobian_transposed(dl);
    r2 = deficit - jacobian_times(dy) + dl / stiffness_;
    const double size = r1.lpNorm<Eigen::Infinity>() + rho_ * (m_ ? r2.lpNorm<Eigen::Infinity>() : 0.0);
    if (size <= small || !(size < 0.5 * last)) break;
    last = size;
  }
}

Eigen::VectorXd NewtonSystem::jacobian_transposed(const Eigen::VectorXd& lambda) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(n_);
  for (std::size_t k = 0; k < jacobian_.size(); ++k) out[jacobian_[k].column] += j_[static_cast<long>(k)] * lambda[jacobian_[k].row];
  return out;
}

Eigen::VectorXd NewtonSystem::jacobian_times(const Eigen::VectorXd& y) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(m_);
  for (std::size_t k = 0; k < jacobian_.size(); ++k) out[jacobian_[k].row] += j_[static_cast<long>(k)] * y[jacobian_[k].column];
  return out;
}

// Lanczos's method on the inverse, where every vector is made orthogonal to all earlier ones. After k solves it gives
// the best combination of k inverse iterations. The last inverse iteration alone may be far off, because the shift can
// be a hundred times the curvature.
Eigen::VectorXd NewtonSystem::softest_direction(const Eigen::VectorXd& sigma) {
  shift_ = 0;
  if (!shift_until_positive(w_, sigma)) return Eigen::VectorXd::Zero(n_);
  const int most = std::min(kLanczosSteps, n_);
  Eigen::MatrixXd basis(n_, most), projected = Eigen::MatrixXd::Zero(most, most);
  Eigen::VectorXd v(n_);  // the start has a share of every component and is always the same
  for (long i = 0; i < v.size(); ++i) v[i] = std::sin(1.0 + 2.399963 * static_cast<double>(i));
  int steps = 0;
  for (double size = v.norm(); steps < most && size > 0; ++steps) {
    basis.col(steps) = v / size;
    v = basis.col(steps);
    factors_.solve(v);
    const double before = v.norm();
    const auto known = basis.leftCols(steps + 1);
    for (int round = 0; round < 2; ++round) {  // twice is enough (Kahan, Parlett)
      const Eigen::VectorXd along = known.transpose() * v;
      v -= known * along;
      projected.col(steps).head(steps + 1) += along;
    }
    size = v.norm() > 1e-10 * before ? v.norm() : 0;
  }
  const Eigen::MatrixXd upper = projected.topLeftCorner(steps, steps);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> ritz(upper.transpose());  // reads the lower triangle
  return (basis.leftCols(steps) * ritz.eigenvectors().col(steps - 1)).normalized();
}

Eigen::VectorXd NewtonSystem::fitted_multipliers(const Eigen::VectorXd& slope) {
  std::fill(factors_.values().begin(), factors_.values().end(), 0.0);
  for (int i = 0; i < n_; ++i) factors_.values()[factors_.diagonal(i)] = 1.0;
  add_normal(kStiffest);
  if (!factors_.factor()) return Eigen::VectorXd::Zero(m_);
  Eigen::VectorXd d = -slope;
  factors_.solve(d);
  return kStiffest * jacobian_times(d);
}

}  // namespace debulk
