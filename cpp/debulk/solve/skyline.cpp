#include "debulk/solve/skyline.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

// Compiled for several instruction sets and chosen at run time. Eight running sums in a fixed order, without fused
// multiply-add: the same bits on each.
#define DEBULK_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))

constexpr long kLanes = 8;
typedef double Lanes __attribute__((vector_size(kLanes * sizeof(double)), aligned(8), may_alias));

inline __attribute__((always_inline)) double dot(const double* a, const double* b, long count) {
  Lanes sums = {};
  long k = 0;
  for (; k + kLanes <= count; k += kLanes) sums += *reinterpret_cast<const Lanes*>(a + k) * *reinterpret_cast<const Lanes*>(b + k);
  double rest = 0;
  for (; k < count; ++k) rest += a[k] * b[k];
  return (((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))) + rest;
}

// to -= factor * from.
inline __attribute__((always_inline)) void subtract(double* to, double factor, const double* from, long count) {
  for (long k = 0; k < count; ++k) to[k] -= factor * from[k];
}

DEBULK_WIDE bool factor_rows(int size, const int* first, const std::size_t* start, double* values) {
  for (int i = 0; i < size; ++i) {
    const int fi = first[i];
    double* row = values + start[i];
    const double before = row[i - fi];
    for (int j = fi; j < i; ++j) {
      const int fj = first[j], from = std::max(fi, fj);
      const double* other = values + start[j];
      row[j - fi] = (row[j - fi] - dot(row + (from - fi), other + (from - fj), j - from)) / other[j - fj];
    }
    const double pivot = before - dot(row, row, i - fi);
    if (!(pivot > 1e-14 * std::abs(before)) || !std::isfinite(pivot)) return false;
    row[i - fi] = std::sqrt(pivot);
  }
  return true;
}

DEBULK_WIDE void solve_rows(int size, const int* first, const std::size_t* start, const double* values, double* x) {
  for (int i = 0; i < size; ++i) {
    const double* row = values + start[i];
    x[i] = (x[i] - dot(row, x + first[i], i - first[i])) / row[i - first[i]];
  }
  for (int i = size - 1; i >= 0; --i) {
    const double* row = values + start[i];
    x[i] /= row[i - first[i]];
    subtract(x + first[i], x[i], row, i - first[i]);
  }
}

DEBULK_WIDE void multiply_rows(int size, const int* first, const std::size_t* start, const double* values, const double* x, double* out) {
  for (int i = 0; i < size; ++i) {
    const double* row = values + start[i];
    out[i] += dot(row, x + first[i], i - first[i] + 1);
    subtract(out + first[i], -x[i], row, i - first[i]);
  }
}

}  // namespace

Skyline::Skyline(int size, const std::vector<std::pair<int, int>>& lower) : first_(static_cast<std::size_t>(size)) {
  for (int i = 0; i < size; ++i) first_[static_cast<std::size_t>(i)] = i;
  for (const auto& [row, column] : lower) first_[static_cast<std::size_t>(row)] = std::min(first_[static_cast<std::size_t>(row)], column);
  start_.assign(1, 0);
  for (int i = 0; i < size; ++i) start_.push_back(start_.back() + static_cast<std::size_t>(i - first_[static_cast<std::size_t>(i)] + 1));
  values_.assign(start_.back(), 0.0);
}

void Skyline::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& out) const {
  out.setZero(x.size());
  multiply_rows(size(), first_.data(), start_.data(), values_.data(), x.data(), out.data());
}

bool Skyline::factor() {
  return factor_rows(size(), first_.data(), start_.data(), values_.data());
}

void Skyline::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  solve_rows(size(), first_.data(), start_.data(), values_.data(), x.data());
}

}  // namespace debulk
