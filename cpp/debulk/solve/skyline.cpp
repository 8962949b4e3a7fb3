#include "debulk/solve/skyline.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace debulk {
namespace {

constexpr int kPanel = 4;
constexpr int kBehind = 7;  // values behind a row that a vector of eight, begun in the panel's last column, may touch

using Panel = Skyline::Panel;

#define DEBULK_KERNEL "debulk/solve/skyline_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

Skyline::Skyline(int size, const std::vector<std::pair<int, int>>& lower, Isa isa) : isa_(isa), last_(static_cast<std::size_t>(size)) {
  for (int i = 0; i < size; ++i) last_[static_cast<std::size_t>(i)] = i;
  for (const auto& [row, column] : lower) last_[static_cast<std::size_t>(column)] = std::max(last_[static_cast<std::size_t>(column)], row);
  for (std::size_t i = 1; i < last_.size(); ++i) last_[i] = std::max(last_[i], last_[i - 1]);  // the fill-in
  std::size_t from = 0;
  for (int j = 0; j < size; j += kPanel) {
    const int last = last_[static_cast<std::size_t>(std::min(j + kPanel, size) - 1)];
    const long stride = (std::max(last - j + 1, kPanel) + kBehind + 7) / 8 * 8;
    panels_.push_back({last, from, stride});
    for (int r = 0; r < kPanel; ++r, from += static_cast<std::size_t>(stride))
      if (j + r < size) start_.push_back(from + static_cast<std::size_t>(r));
  }
  values_.assign(from, 0.0);
  x_.assign(static_cast<std::size_t>(size + kPanel), 0.0);
  product_ = x_;
}

void Skyline::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& out) {
  std::copy_n(x.data(), size(), x_.begin());
  std::fill(x_.begin() + size(), x_.end(), 0.0);
  std::fill(product_.begin(), product_.end(), 0.0);
  DEBULK_ON(isa_, multiply_rows(size(), panels_.data(), values_.data(), x_.data(), product_.data()));
  out = Eigen::Map<const Eigen::VectorXd>(product_.data(), size());
}

bool Skyline::factor() {
  return DEBULK_ON(isa_, factor_rows(size(), panels_.data(), values_.data()));
}

void Skyline::solve(Eigen::Ref<Eigen::VectorXd> x) {
  std::copy_n(x.data(), size(), x_.begin());
  std::fill(x_.begin() + size(), x_.end(), 0.0);
  DEBULK_ON(isa_, solve_rows(size(), panels_.data(), values_.data(), x_.data()));
  std::copy_n(x_.begin(), size(), x.data());
}

}  // namespace debulk
