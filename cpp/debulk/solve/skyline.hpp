#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/simd.hpp"

namespace debulk {

// Cholesky factorisation of a symmetric positive definite matrix with a skyline: row i of the upper triangle is stored
// from the diagonal to the last column that is not zero. It works on four rows at a time. For the narrow matrices of a
// net numbered row by row, this is several times as fast as a general sparse factorisation (docs/solver.md, section 9).
class Skyline {
 public:
  Skyline() = default;
  // lower: the (row, column) entries of the lower triangle that may be non-zero. The diagonal entries always belong to
  // them.
  Skyline(int size, const std::vector<std::pair<int, int>>& lower, Isa isa = best_isa());

  int size() const { return static_cast<int>(last_.size()); }
  // The index in values() of entry (row, column) of the lower triangle, which must belong to the pattern.
  std::size_t place(int row, int column) const { return diagonal(column) + static_cast<std::size_t>(row - column); }
  std::size_t diagonal(int row) const { return start_[static_cast<std::size_t>(row)]; }
  int last(int row) const { return last_[static_cast<std::size_t>(row)]; }  // last column of a row
  // Must be zero wherever no entry has a place; factor() leaves meaningless values there.
  std::vector<double>& values() { return values_; }
  const std::vector<double>& values() const { return values_; }

  // Computes the product of the symmetric matrix (before factor()) with a vector.
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& out);
  // Replaces the values by the factor U of U^T U. Returns false, with the values destroyed, at a pivot that is not
  // positive.
  bool factor();
  // Solves in place with the factor.
  void solve(Eigen::Ref<Eigen::VectorXd> x);

  // Four consecutive rows, each stored from the column of the first of them on.
  struct Panel {
    int last;          // last column of the last row
    std::size_t from;  // index of the first row in values()
    long stride;       // distance between rows: their columns, and zeros behind them
  };

 private:
  Isa isa_ = Isa::base;
  std::vector<int> last_;           // last column of each row
  std::vector<std::size_t> start_;  // index in values_ of each row's diagonal
  std::vector<Panel> panels_;
  std::vector<double> values_;
  std::vector<double> x_, product_;  // buffers of multiply() and solve(), longer than the matrix by a panel
};

}  // namespace debulk
