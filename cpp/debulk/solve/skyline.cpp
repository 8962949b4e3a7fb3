#include "debulk/solve/skyline.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

// Compiled for several instruction sets and chosen at run time; sums run in a fixed order, without fused multiply-add: the
// same bits on each.
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

constexpr int kPanel = 4;  // rows eliminated together

// Rows of the panel, behind it, one after the other with the same columns: zeros where a row has ended.
void copy_panel(int first_row, int rows, int first_column, int width, const int* last, const std::size_t* start, const double* values,
                double* panel) {
  for (int p = 0; p < kPanel; ++p, panel += width) {
    const int row = first_row + p, count = p < rows ? std::max(0, last[row] - first_column + 1) : 0;
    if (count > 0) std::copy_n(values + start[row] + (first_column - row), count, panel);
    std::fill(panel + count, panel + width, 0.0);
  }
}

// Element by element, each in the same order: no sum whose order the width of the instructions could change.
DEBULK_WIDE bool factor_rows(int size, const int* last, const std::size_t* start, double* values, double* before, double* panel) {
  for (int i = 0; i < size; ++i) before[i] = values[start[i]];
  for (int j = 0; j < size; j += kPanel) {
    const int rows = std::min(kPanel, size - j);
    for (int p = j; p < j + rows; ++p) {
      double* row = values + start[p];
      if (!(row[0] > 1e-14 * std::abs(before[p])) || !std::isfinite(row[0])) return false;
      const double inverse = 1 / std::sqrt(row[0]);
      const int count = last[p] - p + 1;
      for (int k = 0; k < count; ++k) row[k] *= inverse;
      for (int r = p + 1; r < j + rows && r <= last[p]; ++r) subtract(values + start[r], row[r - p], row + (r - p), last[p] - r + 1);
    }
    const int next = j + kPanel, width = last[j + rows - 1] - next + 1;
    if (width <= 0) continue;
    copy_panel(j, rows, next, width, last, start, values, panel);
    const double *a = panel, *b = a + width, *c = b + width, *d = c + width;
    for (int i = 0; i < width; ++i) {
      double* row = values + start[next + i] - i;
      const double ai = a[i], bi = b[i], ci = c[i], di = d[i];
      for (int k = i; k < width; ++k) row[k] = row[k] - ((ai * a[k] + bi * b[k]) + (ci * c[k] + di * d[k]));
    }
  }
  return true;
}

DEBULK_WIDE void solve_rows(int size, const int* last, const std::size_t* start, const double* values, double* x) {
  for (int i = 0; i < size; ++i) {
    const double* row = values + start[i];
    x[i] /= row[0];
    subtract(x + i + 1, x[i], row + 1, last[i] - i);
  }
  for (int i = size - 1; i >= 0; --i) {
    const double* row = values + start[i];
    x[i] = (x[i] - dot(row + 1, x + i + 1, last[i] - i)) / row[0];
  }
}

DEBULK_WIDE void multiply_rows(int size, const int* last, const std::size_t* start, const double* values, const double* x, double* out) {
  for (int i = 0; i < size; ++i) {
    const double* row = values + start[i];
    out[i] += dot(row, x + i, last[i] - i + 1);
    subtract(out + i + 1, -x[i], row + 1, last[i] - i);
  }
}

}  // namespace

Skyline::Skyline(int size, const std::vector<std::pair<int, int>>& lower) : last_(static_cast<std::size_t>(size)), before_(last_.size()) {
  for (int i = 0; i < size; ++i) last_[static_cast<std::size_t>(i)] = i;
  for (const auto& [row, column] : lower) last_[static_cast<std::size_t>(column)] = std::max(last_[static_cast<std::size_t>(column)], row);
  for (std::size_t i = 1; i < last_.size(); ++i) last_[i] = std::max(last_[i], last_[i - 1]);  // fill-in
  start_.assign(1, 0);
  int widest = 0;
  for (int i = 0; i < size; ++i) {
    const int length = last_[static_cast<std::size_t>(i)] - i + 1;
    start_.push_back(start_.back() + static_cast<std::size_t>(length));
    widest = std::max(widest, length);
  }
  values_.assign(start_.back(), 0.0);
  panel_.resize(static_cast<std::size_t>(kPanel * (widest + kPanel)));
}

void Skyline::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& out) const {
  out.setZero(x.size());
  multiply_rows(size(), last_.data(), start_.data(), values_.data(), x.data(), out.data());
}

bool Skyline::factor() {
  return factor_rows(size(), last_.data(), start_.data(), values_.data(), before_.data(), panel_.data());
}

void Skyline::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  solve_rows(size(), last_.data(), start_.data(), values_.data(), x.data());
}

}  // namespace debulk
