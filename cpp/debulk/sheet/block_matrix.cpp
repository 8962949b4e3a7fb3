#include "debulk/sheet/block_matrix.hpp"

#include <algorithm>
#include <utility>

namespace debulk {

BlockMatrix::BlockMatrix(int nodes, const std::vector<std::array<int, 3>>& groups, const std::vector<char>& held) : nodes_(nodes) {
  const auto moves = [&](int i) { return held.empty() || !held[static_cast<std::size_t>(i)]; };
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(groups.size() * 3 + static_cast<std::size_t>(nodes));
  for (int i = 0; i < nodes; ++i)
    if (moves(i)) pairs.emplace_back(i, i);
  for (const auto& group : groups)
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < a; ++b)
        if (moves(group[a]) && moves(group[b])) pairs.emplace_back(std::max(group[a], group[b]), std::min(group[a], group[b]));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());

  starts_.assign(static_cast<std::size_t>(nodes) + 1, 0);
  for (const auto& [i, j] : pairs) {
    rows_.push_back(i);
    columns_.push_back(j);
    ++starts_[static_cast<std::size_t>(i) + 1];
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(nodes); ++i) starts_[i + 1] += starts_[i];
  values_.assign(pairs.size(), Eigen::Matrix3d::Zero());
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
