#include "debulk/surface/spline_row.hpp"

#include <algorithm>

#include "debulk/core/wide.hpp"

namespace debulk {

DEBULK_WIDE void spline_row(const double* __restrict u, int count, int n, int from, const double* __restrict value,
                            const double* __restrict slope, double* __restrict by_slope, double* __restrict by_value) {
  for (int k = 0; k < count; ++k) {
    const int first = std::min(static_cast<int>(u[k]), n - 2);
    const double t = u[k] - first, s = 1 - t;
    const double* v = value + (first - from);
    const double* w = slope + (first - from);
    double fx = 0, fy = 0;
    fx += -s * s / 2 * v[0];
    fx += (3 * t * t - 4 * t) / 2 * v[1];
    fx += (4 * s - 3 * s * s) / 2 * v[2];
    fx += t * t / 2 * v[3];
    fy += s * s * s / 6 * w[0];
    fy += (4 - 6 * t * t + 3 * t * t * t) / 6 * w[1];
    fy += (4 - 6 * s * s + 3 * s * s * s) / 6 * w[2];
    fy += t * t * t / 6 * w[3];
    by_slope[k] = fx, by_value[k] = fy;
  }
}

DEBULK_WIDE void spline_weights(const double* __restrict u, int count, int n, int* __restrict first, double* __restrict values) {
  double* __restrict a = values, * __restrict b = a + count, * __restrict c = b + count, * __restrict d = c + count;
  const double last = n - 2;
  for (int k = 0; k < count; ++k) {
    first[k] = static_cast<int>(std::min(std::max(u[k], 0.0), last));
    const double t = u[k] - first[k], s = 1 - t;
    a[k] = s * s * s / 6;
    b[k] = (4 - 6 * t * t + 3 * t * t * t) / 6;
    c[k] = (4 - 6 * s * s + 3 * s * s * s) / 6;
    d[k] = t * t * t / 6;
  }
}

DEBULK_WIDE void weighted_rows(const double* const* rows, const double* weights, int count, double* __restrict out) {
  const double *a = rows[0], *b = rows[1], *c = rows[2], *d = rows[3];
  for (int i = 0; i < count; ++i) out[i] = weights[0] * a[i] + weights[1] * b[i] + weights[2] * c[i] + weights[3] * d[i];
}

}  // namespace debulk
