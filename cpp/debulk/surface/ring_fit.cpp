#include "debulk/surface/ring_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace debulk {

double RingFit::Polynomial::operator()(double u, double v) const {
  double sum = 0;
  for (int a = degree; a >= 0; --a) {
    double inner = 0;
    for (int b = degree - a; b >= 0; --b) inner = inner * v + of[a][b];
    sum = sum * u + inner;
  }
  return sum;
}

// The ring's sums of u^a v^b, from which all normal equations are made, and of z u^a v^b.
RingFit::Polynomial RingFit::moments(const std::vector<RingPoint>& ring, Polynomial& heights) const {
  Polynomial sums;
  for (const RingPoint& p : ring) {
    const double u = across(p.x), v = along(p.y);
    double powers[2 * highest + 1];
    powers[0] = 1;
    for (int b = 1; b <= 2 * highest; ++b) powers[b] = powers[b - 1] * v;
    double power = 1;
    for (int a = 0; a <= 2 * highest; ++a, power *= u)
      for (int b = 0; b <= 2 * highest - a; ++b) sums.of[a][b] += power * powers[b];
    power = p.z;
    for (int a = 0; a <= highest; ++a, power *= u)
      for (int b = 0; b <= highest - a; ++b) heights.of[a][b] += power * powers[b];
  }
  return sums;
}

RingFit::RingFit(const std::vector<RingPoint>& ring, const std::vector<RingPoint>& hole, int highest_degree) {
  double left = ring[0].x, right = left, low = ring[0].y, high = low;
  for (const RingPoint& p : ring) {
    left = std::min(left, p.x), right = std::max(right, p.x);
    low = std::min(low, p.y), high = std::max(high, p.y);
  }
  x0_ = (left + right) / 2, y0_ = (low + high) / 2;
  inverse_ = 2 / std::max({right - left, high - low, 2.0});
  Polynomial heights;
  const Polynomial sums = moments(ring, heights);

  constexpr int most = (highest + 1) * (highest + 2) / 2;
  using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most, most>;
  using Terms = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most, 1>;
  for (const int degree : {4, 2, 1, 0}) {
    if (degree > highest_degree) continue;
    int count = 0, power_u[most], power_v[most];
    for (int a = 0; a <= degree; ++a)
      for (int b = 0; a + b <= degree; ++b, ++count) power_u[count] = a, power_v[count] = b;
    if (degree > 0 && static_cast<int>(ring.size()) < 2 * count) continue;
    Normal normal(count, count);
    Terms right_side(count);
    for (int i = 0; i < count; ++i) {
      right_side(i) = heights.of[power_u[i]][power_v[i]];
      for (int j = 0; j < count; ++j) normal(i, j) = sums.of[power_u[i] + power_u[j]][power_v[i] + power_v[j]];
    }
    const Eigen::LLT<Normal> factors(normal);
    if (factors.info() != Eigen::Success || !(factors.rcond() > 1e-13)) continue;
    // The variance of the prediction at t is tᵀ N⁻¹ t, in units of one value's variance. It is a polynomial, too.
    const Normal inverse = factors.solve(Normal::Identity(count, count));
    Polynomial variance;
    variance.degree = 2 * degree;
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < count; ++j) variance.of[power_u[i] + power_u[j]][power_v[i] + power_v[j]] += inverse(i, j);
    const auto steady = [&](const RingPoint& p) { return variance(across(p.x), along(p.y)) <= 1; };
    if (degree > 0 && !std::all_of(hole.begin(), hole.end(), steady)) continue;
    const Terms coefficients = factors.solve(right_side);
    fit_.degree = degree;
    for (int i = 0; i < count; ++i) fit_.of[power_u[i]][power_v[i]] = coefficients(i);
    return;
  }
}

double RingFit::operator()(double x, double y) const {
  return fit_(across(x), along(y));
}

}  // namespace debulk
