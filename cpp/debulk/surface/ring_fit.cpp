#include "debulk/surface/ring_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace debulk {

// Monomials up to the degree, in coordinates in which ring and hole lie within [-1, 1]; returns their number.
int RingFit::terms(double x, double y, double* out) const {
  const double u = (x - x0_) / scale_, v = (y - y0_) / scale_;
  int k = 0;
  double power = 1;
  for (int a = 0; a <= degree_; ++a, power *= u) {
    double term = power;
    for (int b = 0; a + b <= degree_; ++b, term *= v) out[k++] = term;
  }
  return k;
}

RingFit::RingFit(const std::vector<RingPoint>& ring, const std::vector<RingPoint>& hole, int highest_degree) {
  double left = ring[0].x, right = left, low = ring[0].y, high = low;
  for (const RingPoint& p : ring) {
    left = std::min(left, p.x), right = std::max(right, p.x);
    low = std::min(low, p.y), high = std::max(high, p.y);
  }
  x0_ = (left + right) / 2, y0_ = (low + high) / 2;
  scale_ = std::max({right - left, high - low, 2.0}) / 2;

  for (const int degree : {4, 2, 1, 0}) {
    if (degree > highest_degree) continue;
    degree_ = degree;
    const int count = (degree + 1) * (degree + 2) / 2;
    if (degree > 0 && static_cast<int>(ring.size()) < 2 * count) continue;
    double sums[most] = {}, squares[most][most] = {}, t[most];
    for (const RingPoint& p : ring) {
      terms(p.x, p.y, t);
      for (int a = 0; a < count; ++a) {
        sums[a] += p.z * t[a];
        for (int b = 0; b < count; ++b) squares[a][b] += t[a] * t[b];
      }
    }
    Normal normal(count, count);
    for (int a = 0; a < count; ++a)
      for (int b = 0; b < count; ++b) normal(a, b) = squares[a][b];
    const Eigen::LLT<Normal> factors(normal);
    if (factors.info() != Eigen::Success || !(factors.rcond() > 1e-13)) continue;
    // The variance of the prediction at t is tᵀ N⁻¹ t = |L⁻¹ t|², in units of one value's.
    const Normal& lower = factors.matrixLLT();
    const auto variance = [&](const RingPoint& p) {
      double y[most], sum = 0;
      terms(p.x, p.y, y);
      for (int b = 0; b < count; ++b) {
        y[b] /= lower(b, b), sum += y[b] * y[b];
        for (int a = b + 1; a < count; ++a) y[a] -= lower(a, b) * y[b];
      }
      return sum;
    };
    if (degree > 0 && !std::all_of(hole.begin(), hole.end(), [&](const RingPoint& p) { return variance(p) <= 1; })) continue;
    coefficients_ = factors.solve(Eigen::Map<const Terms>(sums, count));
    return;
  }
}

double RingFit::operator()(double x, double y) const {
  double t[most], sum = 0;
  const int count = terms(x, y, t);
  for (int k = 0; k < count; ++k) sum += t[k] * coefficients_[k];
  return sum;
}

}  // namespace debulk
