#include "debulk/solve/skyline.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

// Four running sums in a fixed order: fast, and the same bits everywhere.
double dot(const double* a, const double* b, long count) {
  double s0 = 0, s1 = 0, s2 = 0, s3 = 0;
  long k = 0;
  for (; k + 4 <= count; k += 4) {
    s0 += a[k] * b[k];
    s1 += a[k + 1] * b[k + 1];
    s2 += a[k + 2] * b[k + 2];
    s3 += a[k + 3] * b[k + 3];
  }
  for (; k < count; ++k) s0 += a[k] * b[k];
  return (s0 + s2) + (s1 + s3);
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
  for (int i = 0; i < size(); ++i) {
    const int f = first_[static_cast<std::size_t>(i)];
    const double* row = &values_[start_[static_cast<std::size_t>(i)]];
    const double xi = x[i];
    double sum = 0;
    for (int j = f; j < i; ++j) {
      sum += row[j - f] * x[j];
      out[j] += row[j - f] * xi;
    }
    out[i] += sum + row[i - f] * xi;
  }
}

bool Skyline::factor() {
  for (int i = 0; i < size(); ++i) {
    const int fi = first_[static_cast<std::size_t>(i)];
    double* row = &values_[start_[static_cast<std::size_t>(i)]];
    const double before = row[i - fi];
    for (int j = fi; j < i; ++j) {
      const int fj = first_[static_cast<std::size_t>(j)], from = std::max(fi, fj);
      const double* other = &values_[start_[static_cast<std::size_t>(j)]];
      row[j - fi] = (row[j - fi] - dot(row + (from - fi), other + (from - fj), j - from)) / other[j - fj];
    }
    const double pivot = before - dot(row, row, i - fi);
    if (!(pivot > 1e-14 * std::abs(before)) || !std::isfinite(pivot)) return false;
    row[i - fi] = std::sqrt(pivot);
  }
  return true;
}

void Skyline::solve(Eigen::Ref<Eigen::VectorXd> x) const {
  for (int i = 0; i < size(); ++i) {
    const int f = first_[static_cast<std::size_t>(i)];
    const double* row = &values_[start_[static_cast<std::size_t>(i)]];
    x[i] = (x[i] - dot(row, x.data() + f, i - f)) / row[i - f];
  }
  for (int i = size() - 1; i >= 0; --i) {
    const int f = first_[static_cast<std::size_t>(i)];
    const double* row = &values_[start_[static_cast<std::size_t>(i)]];
    const double xi = x[i] /= row[i - f];
    for (int j = f; j < i; ++j) x[j] -= row[j - f] * xi;
  }
}

}  // namespace debulk
