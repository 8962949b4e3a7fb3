#include "debulk/solve/multipliers.hpp"

#include <Eigen/SparseCholesky>

#include <algorithm>
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

}  // namespace

// Block principal pivoting: all wrong columns change sides at once. If that stops helping, they change one at a time
// (the last one, Murty's rule), which is certain to end.
Multipliers fit_multipliers(const Eigen::SparseMatrix<double>& columns, const Eigen::VectorXd& gradient,
                            const std::vector<int>& non_negative, const Stop& stop) {
  std::vector<char> in(static_cast<std::size_t>(columns.cols()), 1);
  const double scale = std::max(1e-300, gradient.lpNorm<Eigen::Infinity>());
  Multipliers fit;
  std::size_t fewest = non_negative.size() + 1;
  int patience = 3;
  const int most = 20 + 3 * static_cast<int>(non_negative.size());
  for (int round = 0; round < most; ++round) {
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
    } else {
      --patience;
    }
    if (patience < 0) wrong.erase(wrong.begin(), wrong.end() - 1);
    for (const int k : wrong) in[static_cast<std::size_t>(k)] = !in[static_cast<std::size_t>(k)];
  }
  for (const int k : non_negative) fit.x[k] = std::max(0.0, fit.x[k]);
  fit.residual = gradient - columns * fit.x;
  return fit;
}

}  // namespace debulk
