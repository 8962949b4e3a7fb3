#pragma once

#include <Eigen/Core>

// Eigen's decomposition of positive definite matrices for tests, compiled once as those of dense.hpp are.
namespace debulk::test {

// U of a = U^T U, and the solution of a x = b by it.
Eigen::MatrixXd cholesky(const Eigen::MatrixXd& a);
Eigen::VectorXd cholesky_solution(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

}  // namespace debulk::test
