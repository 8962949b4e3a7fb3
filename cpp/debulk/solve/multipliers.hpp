#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "debulk/core/stop.hpp"

namespace debulk {

// Least-squares multipliers of a gradient: they minimise |g - A x|^2 over x, where the entries listed in `non_negative`
// may not be below 0. The columns of A are the gradients of the equalities and of the active inequalities. The columns
// may depend on each other; the residual is still that of a least-squares solution. fit_multipliers() throws Stopped
// when the stop is raised.
struct Multipliers {
  Eigen::VectorXd x;
  Eigen::VectorXd residual;  // g - A x
};

Multipliers fit_multipliers(const Eigen::SparseMatrix<double>& columns, const Eigen::VectorXd& gradient,
                            const std::vector<int>& non_negative, const Stop& stop = Stop());

}  // namespace debulk
