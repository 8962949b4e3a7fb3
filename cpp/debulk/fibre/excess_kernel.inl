// The loops of spans.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

DEBULK_INLINE double hypotenuse(double step, double rise) {
  return __builtin_sqrt(step * step + rise * rise);
}

// The excess of each step from point to point, by either mean.
inline void excess_of_steps(const double* fine, const double* coarse, const double* mold, int count, double step, double* __restrict by_fine,
                            double* __restrict by_coarse) {
  for (int k = 0; k < count; ++k) {
    const double rise = mold[k + 1] - mold[k], along_mold = hypotenuse(step, rise);
    by_fine[k] = hypotenuse(step, rise + (fine[k + 1] - fine[k])) - along_mold;
    by_coarse[k] = hypotenuse(step, rise + (coarse[k + 1] - coarse[k])) - along_mold;
  }
}

// The curvature of the ply at each point, over `wide` points to either side; `square` is the square of their distance.
inline void curvatures(const double* coarse, const double* mold, int count, int wide, double square, double* __restrict out) {
  for (int k = 0; k < count; ++k)
    out[k] = (coarse[k - wide] + mold[k - wide] - 2 * (coarse[k] + mold[k]) + coarse[k + wide] + mold[k + wide]) / square;
}

// The places one step to the left and to the right of each point, across the step from it to the next.
inline void beside(const double* x, const double* y, int count, double step, double* __restrict left_x, double* __restrict left_y,
                   double* __restrict right_x, double* __restrict right_y) {
  for (int k = 0; k < count; ++k) {
    const double dx = x[k + 1] - x[k], dy = y[k + 1] - y[k], norm = __builtin_sqrt(dx * dx + dy * dy);
    const double across_x = step * (-dy / norm), across_y = step * (dx / norm);
    left_x[k] = x[k] + across_x, left_y[k] = y[k] + across_y;
    right_x[k] = x[k] - across_x, right_y[k] = y[k] - across_y;
  }
}
