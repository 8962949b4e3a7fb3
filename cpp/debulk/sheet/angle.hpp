#pragma once

#include <algorithm>
#include <cmath>

namespace debulk {

// Functions of the angle theta between two vectors u and v, written in q = |u x v|^2 and d = u . v, which are
// polynomials in u and v. So the energy does not contain an acos of the coordinates, and straight fibres (theta = 0)
// are an ordinary point. With n = sqrt(q), s = q + d^2 = |u|^2 |v|^2:
//   theta = atan2(n, d),  d theta = (d dn - n dd) / s.
// The functions have no branches, so that a loop over corners runs in wide instructions (corner_batch.cpp).
struct AngleLaw {
  double value, q, d, qq, qd, dd;  // the function and its derivatives by q and d
};

#define DEBULK_INLINE inline __attribute__((always_inline))

// Returns atan(x) / x for |x| <= tan(pi / 8), from z = x^2, by a Chebyshev fit of 12 terms with an error of 1.3e-18.
DEBULK_INLINE double atan_over_x(double z) {
  double p = -0.017803896394812563;
  p = p * z + 0.037963903161110833;
  p = p * z - 0.050350497953124393;
  p = p * z + 0.058468667522751390;
  p = p * z - 0.066629502460367913;
  p = p * z + 0.076920451945614815;
  p = p * z - 0.090908968014728134;
  p = p * z + 0.11111110744657100;
  p = p * z - 0.14285714279244968;
  p = p * z + 0.19999999999940837;
  p = p * z - 0.33333333333333121;
  return p * z + 1.0;
}

// theta^2, smooth at theta = 0: with r = theta / n,
//   d/dq = r d / s,  d/dd = -2 r q / s,  dr/dq = (d / s - r) / (2 q),  dr/dd = -1 / s.
// r is computed without dividing by n, by halving the angle three times: theta = 2 atan(n / (|u||v| + d)),
// atan(x) = 2 atan(x / (1 + sqrt(1 + x^2))).
DEBULK_INLINE AngleLaw turning_squared(double q_exact, double d) {
  const double s = q_exact + d * d, l = std::sqrt(s);
  const double q = std::max(q_exact, 1e-24 * s);  // for a fibre folded back on itself: finite, but no longer smooth
  const double n = std::sqrt(q);
  const double one = d > 0 ? l + d : q / (l - d);  // (l + d) (l - d) = q
  const double t1 = n / one, two = 1 + std::sqrt(1 + t1 * t1);
  const double t2 = t1 / two, three = 1 + std::sqrt(1 + t2 * t2);
  const double t3 = t2 / three;
  const double r = 8 * atan_over_x(t3 * t3) / (one * two * three);

  const double inverse_s = 1 / s, d_s = d * inverse_s;
  // The direct formula for dr/dq loses its digits as q -> 0. There we differentiate the series
  // atan(y) / y = 1 - y^2/3 + y^4/5 - ..., y^2 = z = q / d^2.
  const double d2 = d * d, z = q_exact / d2;
  const double slope =
      -1.0 / 3 + z * (2.0 / 5 + z * (-3.0 / 7 + z * (4.0 / 9 + z * (-5.0 / 11 + z * (6.0 / 13 + z * (-7.0 / 15 + z * 8.0 / 17))))));
  const double series = slope / (d2 * d), direct = (d_s - r) / (2 * q);
  const double r_q = d > 0 && z < 0.01 ? series : direct;

  AngleLaw law;
  law.value = r * r * q;
  law.q = r * d_s;
  law.d = -2 * r * q * inverse_s;
  law.qq = d_s * (r_q - r * inverse_s);
  law.qd = (r - d_s - 2 * d * d_s * r) * inverse_s;
  law.dd = 2 * q * (1 + 2 * d * r) * inverse_s * inverse_s;
  return law;
}

// (pi/2 - theta)^2, smooth except where u and v are parallel (a locked net).
DEBULK_INLINE AngleLaw shear_squared(double q_exact, double d) {
  const double s = q_exact + d * d, l = std::sqrt(s);
  const double n = std::sqrt(std::max(q_exact, 1e-24 * s));
  const double t1 = d / (l + n), t2 = t1 / (1 + std::sqrt(1 + t1 * t1));
  const double gamma = 4 * t2 * atan_over_x(t2 * t2);

  const double inverse_s = 1 / s, inverse_n = 1 / n, d_s = d * inverse_s, gamma_n = gamma * inverse_n;
  AngleLaw law;
  law.value = gamma * gamma;
  law.q = -gamma_n * d_s;
  law.d = 2 * gamma * n * inverse_s;
  law.qq = d_s * inverse_s * inverse_n * inverse_n * (d / 2 + gamma_n * (s / 2 + n * n));
  law.qd = -(d_s + gamma_n - 2 * gamma_n * d * d_s) * inverse_s;
  law.dd = 2 * n * (n - 2 * d * gamma) * inverse_s * inverse_s;
  return law;
}

}  // namespace debulk
