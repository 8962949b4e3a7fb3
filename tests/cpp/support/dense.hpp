#pragma once

#include <Eigen/Core>

// Eigen's dense decompositions for tests, compiled once: each costs a file that names it three to eight seconds, and under a
// sanitizer all together two minutes, hence the library of their own, for the rooms' tests that need it.
namespace debulk::test {

using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

// Of a symmetric matrix, or of a x = lambda b x with a positive definite b; ascending.
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& a);
Eigen::VectorXd eigenvalues(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

// The shortest x of those with the least |a x - b|, of each column of b.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

// Q of a = Q R, square.
Eigen::MatrixXd orthogonal(const Eigen::MatrixXd& a);
Exact orthogonal(const Exact& a);

// Of a x = b, found in long double.
Eigen::VectorXd exact_solution(const Exact& a, const Exact& b);

}  // namespace debulk::test
