#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "debulk/core/stop.hpp"

namespace debulk {

// Least-squares multipliers of a gradient: minimise |g - A x|^2 over x, whose entries listed in `non_negative` may not be
// below 0 (columns of A: gradients of equalities and of active inequalities). Columns may depend on each other: the
// residual is that of the least-squares solution all the same. Throws Stopped when the stop is raised.
struct Multipliers {
  Eigen::VectorXd x;
  Eigen::VectorXd residual;  // g - A x
};

Multipliers fit_multipliers(const Eigen::SparseMatrix<double>& columns, const Eigen::VectorXd& gradient,
                            const std::vector<int>& non_negative, const Stop& stop = Stop());

}  // namespace debulk
