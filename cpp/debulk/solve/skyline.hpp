#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/simd.hpp"

namespace debulk {

// Cholesky factorisation of a symmetric positive definite matrix with a skyline: row i of the upper triangle from the
// diagonal to the last column that is not zero. For the narrow matrices of a net numbered row by row, four rows at a time beat
// a general sparse factorisation several times over (docs/solver.md, section 9).
class Skyline {
 public:
  Skyline() = default;
  // Pattern: the (row, column) entries of the lower triangle that may be non-zero. The diagonal always is one.
  Skyline(int size, const std::vector<std::pair<int, int>>& lower, Isa isa = best_isa());

  int size() const { return static_cast<int>(last_.size()); }
  // Where entry (row, column) of the lower triangle, one of the pattern, lies in values().
  std::size_t place(int row, int column) const { return diagonal(column) + static_cast<std::size_t>(row - column); }
  std::size_t diagonal(int row) const { return start_[static_cast<std::size_t>(row)]; }
  int last(int row) const { return last_[static_cast<std::size_t>(row)]; }  // column of a row
  // To be zero wherever no entry has a place; factor() leaves there what means nothing.
  std::vector<double>& values() { return values_; }
  const std::vector<double>& values() const { return values_; }

  // The product of the symmetric matrix (before factor()) with a vector.
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& out);
  // Replaces the values by the factor U of U^T U. False, with the values spoilt, at a pivot that is not positive.
  bool factor();
  // Solves in place with the factor.
  void solve(Eigen::Ref<Eigen::VectorXd> x);

  // Four rows, one behind the other, each from the column of the first of them on.
  struct Panel {
    int last;          // column of the last row
    std::size_t from;  // of the first row in values()
    long stride;       // between rows: their columns, and zeros behind them
  };

 private:
  Isa isa_ = Isa::base;
  std::vector<int> last_;           // column of a row
  std::vector<std::size_t> start_;  // of a row's diagonal in values_
  std::vector<Panel> panels_;
  std::vector<double> values_;
  std::vector<double> x_, product_;  // room for multiply() and solve(), a panel longer than the rows
};

}  // namespace debulk
