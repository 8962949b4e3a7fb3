#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace debulk {

// Functions of the angle theta between two vectors u and v, through q = |u x v|^2 and d = u . v, which are polynomials
// in u and v: no square root and no acos stands between the coordinates and the energy, so that straight fibres
// (theta = 0) are an ordinary point. With n = sqrt(q) and s = q + d^2:  theta = atan2(n, d),  d theta = (d dn - n dd) / s.
struct AngleLaw {
  double value, q, d, qq, qd, dd;  // the function and its derivatives by q and d
};

// theta^2, smooth at theta = 0: with r = theta / n,
//   d/dq = r d / s,  d/dd = -2 r q / s,  dr/dq = (d / s - r) / (2 q),  dr/dd = -1 / s.
inline AngleLaw turning_squared(double q, double d) {
  const double s = q + d * d;
  double r, r_q;
  if (d > 0 && q < 0.01 * d * d) {  // atan(y) / y = 1 - y^2/3 + y^4/5 - ..., y^2 = z
    const double z = q / (d * d);
    double sum = 0, slope = 0;
    for (int k = 8; k >= 1; --k) {
      const double a = (k % 2 ? -1.0 : 1.0) / (2 * k + 1);
      sum = (sum + a) * z;
      slope = slope * z + a * k;
    }
    r = (1 + sum) / d;
    r_q = slope / (d * d * d);
  } else {
    q = std::max(q, 1e-24 * s);  // a fibre folded back on itself: finite, but no longer smooth
    const double n = std::sqrt(q);
    r = std::atan2(n, d) / n;
    r_q = (d / s - r) / (2 * q);
  }
  AngleLaw law;
  law.value = r * r * q;
  law.q = r * d / s;
  law.d = -2 * r * q / s;
  law.qq = d * (r_q - r / s) / s;
  law.qd = (r - d / s - 2 * d * d * r / s) / s;
  law.dd = 2 * q * (1 + 2 * d * r) / (s * s);
  return law;
}

// (pi/2 - theta)^2, smooth but where u and v are parallel (a locked net).
inline AngleLaw shear_squared(double q, double d) {
  const double s = q + d * d;
  const double n = std::sqrt(std::max(q, 1e-24 * s));
  const double gamma = std::atan2(d, n);
  AngleLaw law;
  law.value = gamma * gamma;
  law.q = -gamma * d / (n * s);
  law.d = 2 * gamma * n / s;
  law.qq = d * (d / 2 + gamma * (s / (2 * n) + n)) / (n * n * s * s);
  law.qd = -(d / s + gamma / n - 2 * gamma * d * d / (n * s)) / s;
  law.dd = 2 * n * (n - 2 * d * gamma) / (s * s);
  return law;
}

// Gradient and Hessian of such a function by u and v.
struct AngleDerivatives {
  Eigen::Vector3d u, v;
  Eigen::Matrix3d uu, uv, vv;
};

inline void angle_gradient(const AngleLaw& law, const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector3d& cross,
                           AngleDerivatives& out) {
  out.u = 2 * law.q * v.cross(cross) + law.d * v;
  out.v = 2 * law.q * cross.cross(u) + law.d * u;
}

inline void angle_hessian(const AngleLaw& law, const Eigen::Vector3d& u, const Eigen::Vector3d& v, const Eigen::Vector3d& cross,
                          AngleDerivatives& out) {
  const Eigen::Vector3d q_u = 2 * v.cross(cross), q_v = 2 * cross.cross(u);
  const double d = u.dot(v);
  const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
  // d^2 q: uu = 2 (|v|^2 - v v^T), uv = 2 (2 u v^T - v u^T - d), vv = 2 (|u|^2 - u u^T);  d^2 d: uv = 1.
  out.uu = 2 * law.q * (v.squaredNorm() * unit - v * v.transpose());
  out.vv = 2 * law.q * (u.squaredNorm() * unit - u * u.transpose());
  out.uv = 2 * law.q * (2 * u * v.transpose() - v * u.transpose() - d * unit) + law.d * unit;
  const Eigen::Vector3d a_u = law.qq * q_u + law.qd * v, b_u = law.qd * q_u + law.dd * v;
  const Eigen::Vector3d a_v = law.qq * q_v + law.qd * u, b_v = law.qd * q_v + law.dd * u;
  out.uu += a_u * q_u.transpose() + b_u * v.transpose();
  out.uv += a_u * q_v.transpose() + b_u * u.transpose();
  out.vv += a_v * q_v.transpose() + b_v * u.transpose();
}

}  // namespace debulk
