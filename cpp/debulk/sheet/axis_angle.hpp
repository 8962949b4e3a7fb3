#pragma once

#include <Eigen/Core>

#include "debulk/sheet/corner_batch.hpp"

namespace debulk {

// The angle about an axis from one vector to another, with its derivatives by the nine coordinates of first, second and
// axis, in this order. Gradient and Hessian are set only up to the order asked for.
struct AxisAngle {
  double theta;  // rad, right-handed about the axis, in (-pi, pi]
  Eigen::Matrix<double, 9, 1> gradient;
  Eigen::Matrix<double, 9, 9> hessian;
};

// Returns the angle between the half-planes that start at the axis e and contain r and s:
//   theta = atan2(S, C),  S = |e| det(r, s, e),  C = (r . s) e^2 - (r . e)(s . e).
// S and C have no singularity, so that an angle of zero is an ordinary point. A vector along the axis has no
// half-plane; its derivatives stay finite but mean nothing.
AxisAngle axis_angle(const Eigen::Vector3d& r, const Eigen::Vector3d& s, const Eigen::Vector3d& e, Order order);

// Returns the matrix of v -> w x v.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& w) {
  Eigen::Matrix3d m;
  m << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return m;
}

}  // namespace debulk
