#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace debulk {

// A sparse symmetric matrix of 3 by 3 blocks, one row of blocks a node: the Hessian of a sum of terms that each couple a
// few nodes. Only blocks (row >= column) are stored. The pattern is fixed once; the values are added to in place.
class BlockMatrix {
 public:
  BlockMatrix() = default;
  // groups: sets of nodes that a term couples all with all. Every node gets a diagonal block. With `held`, one per node,
  // nodes where it is not 0 have no blocks at all.
  BlockMatrix(int nodes, const std::vector<std::array<int, 3>>& groups, const std::vector<char>& held = {});

  int nodes() const { return nodes_; }
  int blocks() const { return static_cast<int>(rows_.size()); }
  int row(int slot) const { return rows_[static_cast<std::size_t>(slot)]; }
  int column(int slot) const { return columns_[static_cast<std::size_t>(slot)]; }
  // Position of block (i, j) or (j, i); -1 where there is none.
  int slot(int i, int j) const;

  void set_zero();
  void set(const BlockMatrix& same_pattern) { values_ = same_pattern.values_; }
  // Adds `block`, which belongs to rows of node i and columns of node j, whichever of the two is stored at `slot`; nothing
  // where slot is -1.
  template <class Block>
  void add(int slot, int i, int j, const Eigen::MatrixBase<Block>& block) {
    if (slot < 0) return;
    if (i >= j)
      values_[static_cast<std::size_t>(slot)] += block;
    else
      values_[static_cast<std::size_t>(slot)] += block.transpose();
  }
  const Eigen::Matrix3d& block(int slot) const { return values_[static_cast<std::size_t>(slot)]; }

  // Lower triangle, 3 * nodes square, order x0 y0 z0 x1 ...
  Eigen::SparseMatrix<double> lower() const;

 private:
  int nodes_ = 0;
  std::vector<int> starts_, rows_, columns_;  // blocks sorted by row, then column
  std::vector<Eigen::Matrix3d> values_;
};

}  // namespace debulk
