#include "debulk/solve/skyline.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr int kPanel = 4;  // rows eliminated together

using Panel = Skyline::Panel;

#define DEBULK_KERNEL "debulk/solve/skyline_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

Skyline::Skyline(int size, const std::vector<std::pair<int, int>>& lower) : last_(static_cast<std::size_t>(size)) {
  for (int i = 0; i < size; ++i) last_[static_cast<std::size_t>(i)] = i;
  for (const auto& [row, column] : lower) last_[static_cast<std::size_t>(column)] = std::max(last_[static_cast<std::size_t>(column)], row);
  for (std::size_t i = 1; i < last_.size(); ++i) last_[i] = std::max(last_[i], last_[i - 1]);  // fill-in
  start_.assign(1, 0);
  for (int i = 0; i < size; ++i) start_.push_back(start_.back() + static_cast<std::size_t>(last_[static_cast<std::size_t>(i)] - i + 1));
  values_.assign(start_.back(), 0.0);
}

void Skyline::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& out) const {
  out.setZero(x.size());
  DEBULK_ON(best_isa(), multiply_rows(size(), last_.data(), start_.data(), values_.data(), x.data(), out.data()));
}

void Skyline::make_room() {
  constexpr int kBehind = 7;  // a vector that begins in a panel's last column
  std::size_t from = 0;
  for (int j = 0; j < size(); j += kPanel) {
    const int last = last_[static_cast<std::size_t>(std::min(j + kPanel, size()) - 1)];
    const int stride = (last - j + 1 + kBehind + 7) / 8 * 8;
    panels_.push_back({last, from, stride});
    from += static_cast<std::size_t>(kPanel) * static_cast<std::size_t>(stride);
  }
  room_.resize(from);
}

bool Skyline::factor() {
  if (panels_.empty()) make_room();
  return DEBULK_ON(best_isa(), factor_rows(size(), last_.data(), start_.data(), values_.data(), panels_.data(), room_.data()));
}

void Skyline::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  DEBULK_ON(best_isa(), solve_rows(size(), last_.data(), start_.data(), values_.data(), x.data()));
}

}  // namespace debulk
