#include "debulk/sheet/block_matrix.hpp"

#include <algorithm>

namespace debulk {

BlockMatrix::BlockMatrix(int nodes, const std::vector<std::array<int, 3>>& groups, const std::vector<char>& held) : nodes_(nodes) {
  const auto moves = [&](int i) { return held.empty() || !held[static_cast<std::size_t>(i)]; };
  std::vector<std::vector<int>> columns(static_cast<std::size_t>(nodes));  // per row; they are few and are kept sorted
  const auto insert = [&](int row, int column) {
    std::vector<int>& in = columns[static_cast<std::size_t>(row)];
    const auto at = std::lower_bound(in.begin(), in.end(), column);
    if (at == in.end() || *at != column) in.insert(at, column);
  };
  for (int i = 0; i < nodes; ++i)
    if (moves(i)) insert(i, i);
  for (const auto& group : groups)
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < a; ++b)
        if (moves(group[a]) && moves(group[b])) insert(std::max(group[a], group[b]), std::min(group[a], group[b]));

  starts_.assign(1, 0);
  for (int i = 0; i < nodes; ++i) {
    const std::vector<int>& in = columns[static_cast<std::size_t>(i)];
    rows_.insert(rows_.end(), in.size(), i);
    columns_.insert(columns_.end(), in.begin(), in.end());
    starts_.push_back(static_cast<int>(columns_.size()));
  }
  values_.assign(columns_.size(), Eigen::Matrix3d::Zero());
}

int BlockMatrix::slot(int i, int j) const {
  const auto row = static_cast<std::size_t>(std::max(i, j));
  const auto first = columns_.begin() + starts_[row], last = columns_.begin() + starts_[row + 1];
  const auto found = std::lower_bound(first, last, std::min(i, j));
  return found != last && *found == std::min(i, j) ? static_cast<int>(found - columns_.begin()) : -1;
}

void BlockMatrix::set_zero() {
  std::fill(values_.begin(), values_.end(), Eigen::Matrix3d::Zero());
}

Eigen::SparseMatrix<double> BlockMatrix::lower() const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(values_.size() * 9);
  for (int k = 0; k < blocks(); ++k)
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        if (3 * row(k) + a >= 3 * column(k) + b) entries.emplace_back(3 * row(k) + a, 3 * column(k) + b, block(k)(a, b));
  Eigen::SparseMatrix<double> matrix(3 * nodes_, 3 * nodes_);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace debulk
