#include "support/cholesky.hpp"

#include <Eigen/Cholesky>

namespace debulk::test {

Eigen::MatrixXd cholesky(const Eigen::MatrixXd& a) {
  return Eigen::LLT<Eigen::MatrixXd>(a).matrixU();
}
Eigen::VectorXd cholesky_solution(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return Eigen::LLT<Eigen::MatrixXd>(a).solve(b);
}

}  // namespace debulk::test
