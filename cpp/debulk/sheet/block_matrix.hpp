#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace debulk {

// A sparse symmetric matrix of 3 by 3 blocks, with one row of blocks per node: the Hessian of a sum of terms that each
// couple a few nodes. Only blocks with row >= column are stored. The pattern is set once; values are then added in
// place.
class BlockMatrix {
 public:
  BlockMatrix() = default;
  // groups: sets of nodes in which a term couples every node with every other. Every node gets a diagonal block.
  // `held`, if given, has one value per node; nodes for which it is not 0 have no blocks.
  BlockMatrix(int nodes, const std::vector<std::array<int, 3>>& groups, const std::vector<char>& held = {});

  int nodes() const { return nodes_; }
  int blocks() const { return static_cast<int>(rows_.size()); }
  int row(int slot) const { return rows_[static_cast<std::size_t>(slot)]; }
  int column(int slot) const { return columns_[static_cast<std::size_t>(slot)]; }
  // Returns the position of block (i, j) or (j, i); -1 if there is none.
  int slot(int i, int j) const;

  void set_zero();
  void set(const BlockMatrix& same_pattern) { values_ = same_pattern.values_; }
  // Adds `block`, which belongs to the rows of node i and the columns of node j, at `slot`, where block (i, j) or
  // (j, i) is stored. Does nothing if slot is -1.
  template <class Block>
  void add(int slot, int i, int j, const Eigen::MatrixBase<Block>& block) {
    if (slot < 0) return;
    if (i >= j)
      values_[static_cast<std::size_t>(slot)] += block;
    else
      values_[static_cast<std::size_t>(slot)] += block.transpose();
  }
  const Eigen::Matrix3d& block(int slot) const { return values_[static_cast<std::size_t>(slot)]; }

  // Returns the lower triangle of the matrix, of size 3 * nodes, in the order x0 y0 z0 x1 ...
  Eigen::SparseMatrix<double> lower() const;

 private:
  int nodes_ = 0;
  std::vector<int> starts_, rows_, columns_;  // blocks sorted by row, then column
  std::vector<Eigen::Matrix3d> values_;
};

}  // namespace debulk
