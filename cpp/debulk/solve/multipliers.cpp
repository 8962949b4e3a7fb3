#include "debulk/solve/multipliers.hpp"

#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace debulk {
namespace {

// Unconstrained least squares over the columns that are `in`; the others are 0. The normal equations are shifted a
// little, so that they can be solved if columns depend on each other. Proximal-point steps correct for the shift; they
// converge to a least-squares solution for any rank.
Eigen::VectorXd least_squares(const Eigen::SparseMatrix<double>& columns, const Eigen::VectorXd& gradient, const std::vector<char>& in) {
  std::vector<int> chosen;
  for (std::size_t k = 0; k < in.size(); ++k)
    if (in[k]) chosen.push_back(static_cast<int>(k));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(columns.cols());
  if (chosen.empty()) return x;

  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t k = 0; k < chosen.size(); ++k)
    for (Eigen::SparseMatrix<double>::InnerIterator it(columns, chosen[k]); it; ++it)
      entries.emplace_back(static_cast<int>(it.row()), static_cast<int>(k), it.value());
  Eigen::SparseMatrix<double> a(columns.rows(), static_cast<long>(chosen.size()));
  a.setFromTriplets(entries.begin(), entries.end());

  const Eigen::SparseMatrix<double> normal = a.transpose() * a;
  const double shift = 1e-11 * std::max(1e-300, normal.diagonal().maxCoeff());
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors;
  factors.setShift(shift);
  factors.compute(normal);
  if (factors.info() != Eigen::Success) return x;
  Eigen::VectorXd part = Eigen::VectorXd::Zero(a.cols());
  double last = std::numeric_limits<double>::infinity();
  for (int step = 0; step < 30; ++step) {
    const Eigen::VectorXd slope = a.transpose() * (gradient - a * part);
    const double size = slope.lpNorm<Eigen::Infinity>();
    if (!(size < 0.5 * last)) break;
    part += factors.solve(slope);
    last = size;
  }
  for (std::size_t k = 0; k < chosen.size(); ++k) x[chosen[k]] = part[static_cast<long>(k)];
  return x;
}

using Vector = Eigen::VectorXd;

double longest_step(const Vector& x, const Vector& dx, const std::vector<int>& positive) {
  double longest = 1;
  for (const int k : positive)
    if (dx[k] < 0) longest = std::min(longest, -0.995 * x[k] / dx[k]);
  return longest;
}

// The same fit by Mehrotra's primal-dual method, which needs no guess of the columns that take part. Where columns
// depend on each other, as the fibres and contacts of a flat net do, there are many fits, and pivoting would go round
// between them; this ends inside the set of them.
Vector interior_fit(const Eigen::SparseMatrix<double>& columns, const Vector& gradient, const std::vector<int>& non_negative,
                    const Stop& stop) {
  constexpr int kSteps = 60;
  constexpr double kSmall = 1e-10;  // of the largest force
  const double scale = std::max(1e-300, gradient.lpNorm<Eigen::Infinity>());
  const auto count = static_cast<double>(non_negative.size());
  Eigen::SparseMatrix<double> normal = columns.transpose() * columns;
  const double shift = 1e-11 * std::max(1e-300, normal.diagonal().maxCoeff());
  Vector x = Vector::Zero(columns.cols()), z = x, diagonal = normal.diagonal().array() + shift;
  for (const int k : non_negative) x[k] = z[k] = scale;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors;
  factors.analyzePattern(normal);
  for (int step = 0; step < kSteps; ++step) {
    if (stop.now()) throw Stopped("while multipliers were fitted");
    const Vector slope = columns.transpose() * (gradient - columns * x) + z;
    const double gap = x.dot(z) / count;
    if (slope.lpNorm<Eigen::Infinity>() <= kSmall * scale && gap <= kSmall * kSmall * scale * scale) break;
    for (int k = 0; k < normal.cols(); ++k) normal.coeffRef(k, k) = diagonal[k];
    for (const int k : non_negative) normal.coeffRef(k, k) += z[k] / x[k];
    factors.factorize(normal);
    if (factors.info() != Eigen::Success) break;
    Vector dx, dz = Vector::Zero(x.size());
    const auto solve = [&](const Vector& product) {  // what x z is to be less
      Vector right = slope;
      for (const int k : non_negative) right[k] -= product[k] / x[k];
      dx = factors.solve(right);
      for (const int k : non_negative) dz[k] = -(product[k] + z[k] * dx[k]) / x[k];
    };
    Vector product = x.cwiseProduct(z);
    solve(product);
    const double first = (x + longest_step(x, dx, non_negative) * dx).dot(z + longest_step(z, dz, non_negative) * dz) / count;
    const double aim = std::pow(std::max(0.0, first) / gap, 3) * gap;
    for (const int k : non_negative) product[k] += dx[k] * dz[k] - aim;
    solve(product);
    if (!dx.allFinite() || !dz.allFinite()) break;
    x += longest_step(x, dx, non_negative) * dx;
    z += longest_step(z, dz, non_negative) * dz;
  }
  return x;
}

}  // namespace

// Block principal pivoting, in which all wrong columns change sides at once. If that stops helping, the columns depend
// on each other, and the interior method decides.
Multipliers fit_multipliers(const Eigen::SparseMatrix<double>& columns, const Eigen::VectorXd& gradient,
                            const std::vector<int>& non_negative, const Stop& stop) {
  std::vector<char> in(static_cast<std::size_t>(columns.cols()), 1);
  const double scale = std::max(1e-300, gradient.lpNorm<Eigen::Infinity>());
  Multipliers fit;
  std::size_t fewest = non_negative.size() + 1;
  int patience = 3;
  while (true) {
    if (stop.now()) throw Stopped("while multipliers were fitted");
    fit.x = least_squares(columns, gradient, in);
    fit.residual = gradient - columns * fit.x;
    std::vector<int> wrong;
    for (const int k : non_negative) {
      const bool inside = in[static_cast<std::size_t>(k)];
      if (inside ? fit.x[k] < -1e-9 * scale : columns.col(k).dot(fit.residual) > 1e-9 * scale) wrong.push_back(k);
    }
    if (wrong.empty()) break;
    if (wrong.size() < fewest) {
      fewest = wrong.size();
      patience = 3;
    } else if (--patience < 0) {
      fit.x = interior_fit(columns, gradient, non_negative, stop);
      break;
    }
    for (const int k : wrong) in[static_cast<std::size_t>(k)] = !in[static_cast<std::size_t>(k)];
  }
  for (const int k : non_negative) fit.x[k] = std::max(0.0, fit.x[k]);
  fit.residual = gradient - columns * fit.x;
  return fit;
}

}  // namespace debulk
