#include "debulk/sheet/corner_batch.hpp"

#include "debulk/core/wide.hpp"
#include "debulk/sheet/angle.hpp"

namespace debulk {
namespace {

struct Vector {
  double x, y, z;
};
DEBULK_INLINE Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
DEBULK_INLINE double dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

using Law = AngleLaw (*)(double, double);

template <Law law>
DEBULK_INLINE void values(CornerBatch& b, int count, double stiffness) {
  for (int k = 0; k < count; ++k) {
    const Vector u{b.u[0][k], b.u[1][k], b.u[2][k]}, v{b.v[0][k], b.v[1][k], b.v[2][k]}, c = cross(u, v);
    b.value[k] = stiffness * law(dot(c, c), dot(u, v)).value;
  }
}

// q_u = 2 v x c, q_v = 2 c x u with c = u x v; d_u = v, d_v = u.
template <Law law>
DEBULK_INLINE void gradients(CornerBatch& b, int count, double stiffness) {
  for (int k = 0; k < count; ++k) {
    const Vector u{b.u[0][k], b.u[1][k], b.u[2][k]}, v{b.v[0][k], b.v[1][k], b.v[2][k]}, c = cross(u, v);
    const AngleLaw e = law(dot(c, c), dot(u, v));
    const Vector vc = cross(v, c), cu = cross(c, u);
    const double q = 2 * stiffness * e.q, d = stiffness * e.d;
    b.value[k] = stiffness * e.value;
    b.by_u[0][k] = q * vc.x + d * v.x;
    b.by_u[1][k] = q * vc.y + d * v.y;
    b.by_u[2][k] = q * vc.z + d * v.z;
    b.by_v[0][k] = q * cu.x + d * u.x;
    b.by_v[1][k] = q * cu.y + d * u.y;
    b.by_v[2][k] = q * cu.z + d * u.z;
  }
}

// Second derivatives of q: uu 2 (|v|^2 - v v^T), vv 2 (|u|^2 - u u^T), uv 2 (2 u v^T - v u^T - d); of d: uv 1.
// Hessian of E(q, d): E_q q'' + E_d d'' + a q'^T + b d'^T with a = E_qq q' + E_qd d', b = E_qd q' + E_dd d'.
template <Law law>
DEBULK_INLINE void hessians(CornerBatch& batch, int count, double stiffness) {
  for (int k = 0; k < count; ++k) {
    const double u[3] = {batch.u[0][k], batch.u[1][k], batch.u[2][k]}, v[3] = {batch.v[0][k], batch.v[1][k], batch.v[2][k]};
    const Vector uu{u[0], u[1], u[2]}, vv{v[0], v[1], v[2]}, c = cross(uu, vv);
    const double dot_uv = dot(uu, vv);
    const AngleLaw e = law(dot(c, c), dot_uv);
    const Vector vc = cross(vv, c), cu = cross(c, uu);
    const double q = 2 * stiffness * e.q, d = stiffness * e.d;
    const double qq = stiffness * e.qq, qd = stiffness * e.qd, dd = stiffness * e.dd;
    const double qu[3] = {2 * vc.x, 2 * vc.y, 2 * vc.z}, qv[3] = {2 * cu.x, 2 * cu.y, 2 * cu.z};
    const double u2 = dot(uu, uu), v2 = dot(vv, vv);
    double au[3], bu[3], av[3], bv[3];
    for (int i = 0; i < 3; ++i) {
      au[i] = qq * qu[i] + qd * v[i];
      bu[i] = qd * qu[i] + dd * v[i];
      av[i] = qq * qv[i] + qd * u[i];
      bv[i] = qd * qv[i] + dd * u[i];
    }
    constexpr int row[6] = {0, 0, 0, 1, 1, 2}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int p = 0; p < 6; ++p) {
      const int i = row[p], j = column[p];
      batch.by_uu[p][k] = au[i] * qu[j] + bu[i] * v[j] - q * v[i] * v[j] + (i == j ? q * v2 : 0.0);
      batch.by_vv[p][k] = av[i] * qv[j] + bv[i] * u[j] - q * u[i] * u[j] + (i == j ? q * u2 : 0.0);
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        batch.by_uv[3 * i + j][k] = au[i] * qv[j] + bu[i] * u[j] + q * (2 * u[i] * v[j] - v[i] * u[j]) + (i == j ? d - q * dot_uv : 0.0);
  }
}

template <Law law>
DEBULK_INLINE void evaluate(CornerBatch& batch, int count, double stiffness, Order order) {
  if (order == Order::value) values<law>(batch, count, stiffness);
  if (order == Order::gradient) gradients<law>(batch, count, stiffness);
  if (order == Order::hessian) hessians<law>(batch, count, stiffness);
}

}  // namespace

DEBULK_WIDE void turning_batch(CornerBatch& batch, int count, double stiffness, Order order) {
  evaluate<turning_squared>(batch, count, stiffness, order);
}

DEBULK_WIDE void shear_batch(CornerBatch& batch, int count, double stiffness, Order order) {
  evaluate<shear_squared>(batch, count, stiffness, order);
}

}  // namespace debulk
