#include "debulk/surface/ring_fit.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace debulk {

// Monomials up to the degree, in coordinates in which ring and hole lie within [-1, 1].
Eigen::VectorXd RingFit::terms(double x, double y) const {
  const double u = (x - x0_) / scale_, v = (y - y0_) / scale_;
  Eigen::VectorXd out((degree_ + 1) * (degree_ + 2) / 2);
  Eigen::Index k = 0;
  double power = 1;
  for (int a = 0; a <= degree_; ++a, power *= u) {
    double term = power;
    for (int b = 0; a + b <= degree_; ++b, term *= v) out[k++] = term;
  }
  return out;
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
    const Eigen::Index count = (degree + 1) * (degree + 2) / 2;
    if (degree > 0 && static_cast<Eigen::Index>(ring.size()) < 2 * count) continue;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(count);
    for (const RingPoint& p : ring) {
      const Eigen::VectorXd t = terms(p.x, p.y);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(t);
      sums += p.z * t;
    }
    const Eigen::LLT<Eigen::MatrixXd> factors(normal);
    if (factors.info() != Eigen::Success || !(factors.rcond() > 1e-13)) continue;
    // The variance of the prediction at t is tᵀ N⁻¹ t = |L⁻¹ t|², in units of one value's.
    const bool quiet = degree == 0 || std::all_of(hole.begin(), hole.end(), [&](const RingPoint& p) {
                         return factors.matrixL().solve(terms(p.x, p.y)).squaredNorm() <= 1;
                       });
    if (!quiet) continue;
    coefficients_ = factors.solve(sums);
    return;
  }
}

double RingFit::operator()(double x, double y) const {
  return terms(x, y).dot(coefficients_);
}

}  // namespace debulk
