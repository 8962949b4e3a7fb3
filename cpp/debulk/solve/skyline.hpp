#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

namespace debulk {

// Cholesky factorisation of a symmetric positive definite matrix in skyline storage: row i from its first non-zero column
// to the diagonal, one row behind the other. For the narrow matrices of a net numbered row by row, dot products of
// consecutive numbers beat a general sparse factorisation several times over (model.md, section 4).
class Skyline {
 public:
  Skyline() = default;
  // Pattern: the (row, column) entries of the lower triangle that may be non-zero. The diagonal always is one.
  Skyline(int size, const std::vector<std::pair<int, int>>& lower);

  int size() const { return static_cast<int>(first_.size()); }
  // Where entry (row, column), row >= column >= first column of that row, lies in values().
  std::size_t place(int row, int column) const { return diagonal(row) - static_cast<std::size_t>(row - column); }
  std::size_t diagonal(int row) const { return start_[static_cast<std::size_t>(row) + 1] - 1; }
  std::vector<double>& values() { return values_; }
  const std::vector<double>& values() const { return values_; }

  // The product of the symmetric matrix (before factor()) with a vector.
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& out) const;
  // Replaces the values by the factor L of L L^T. False, with the values spoilt, at a pivot that is not positive.
  bool factor();
  // Solves in place with the factor.
  void solve(Eigen::Ref<Eigen::VectorXd> x) const;

 private:
  std::vector<int> first_;          // first column of a row
  std::vector<std::size_t> start_;  // of a row in values_
  std::vector<double> values_;
};

}  // namespace debulk
