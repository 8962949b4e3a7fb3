// The loops of skyline.cpp, which includes this file once per Isa (see core/simd_dispatch.inl). Sums run in a fixed
// order, element by element or in four lanes, whatever the width of the instructions.

constexpr int kWide = register_bytes / sizeof(double);
typedef double Wide __attribute__((vector_size(register_bytes)));
// As wide as a panel, so that a panel reads values in the same pieces in which the one before wrote them.
typedef double Four __attribute__((vector_size(32)));

template <class Vector>
DEBULK_INLINE void get(Vector& v, const double* from) {
  std::memcpy(&v, from, sizeof v);
}
template <class Vector>
DEBULK_INLINE void put(double* to, const Vector& v) {
  std::memcpy(to, &v, sizeof v);
}
DEBULK_INLINE double total(const Four& v) {
  return (v[0] + v[2]) + (v[1] + v[3]);
}

// Subtracts from the rows of a panel the contributions of all panels before it, some columns at a time, which stay in
// registers meanwhile.
DEBULK_INLINE void eliminate(const Panel* panels, int number, double* values) {
  const int first_row = kPanel * number, last = panels[number].last;
  double* to = values + panels[number].from;
  const long stride = panels[number].stride;
  int reaches = 0;  // the first panel that reaches these columns
  for (int column = first_row; column <= last; column += kWide) {
    while (panels[reaches].last < column) ++reaches;
    const long k = column - first_row;
    Wide one, two, three, four;
    get(one, to + k), get(two, to + k + stride), get(three, to + k + 2 * stride), get(four, to + k + 3 * stride);
    for (int p = reaches; p < number; ++p) {
      const long step = panels[p].stride;
      const double *a = values + panels[p].from + (first_row - kPanel * p), *b = a + step, *c = b + step, *d = c + step;
      Wide ak, bk, ck, dk;
      get(ak, a + k), get(bk, b + k), get(ck, c + k), get(dk, d + k);
      one -= (a[0] * ak + b[0] * bk) + (c[0] * ck + d[0] * dk);
      two -= (a[1] * ak + b[1] * bk) + (c[1] * ck + d[1] * dk);
      three -= (a[2] * ak + b[2] * bk) + (c[2] * ck + d[2] * dk);
      four -= (a[3] * ak + b[3] * bk) + (c[3] * ck + d[3] * dk);
    }
    put(to + k, one), put(to + k + stride, two), put(to + k + 2 * stride, three), put(to + k + 3 * stride, four);
  }
}

bool factor_rows(int size, const Panel* panels, double* values) {
  for (int j = 0, number = 0; j < size; j += kPanel, ++number) {
    const int rows = std::min(kPanel, size - j);
    double* panel = values + panels[number].from;
    const long stride = panels[number].stride, width = panels[number].last - j + 1;
    double before[kPanel] = {};
    for (int r = 0; r < rows; ++r) before[r] = panel[r * stride + r];
    eliminate(panels, number, values);
    for (int r = 0; r < rows; ++r) {
      double* row = panel + r * stride;
      if (!(row[r] > 1e-14 * std::abs(before[r])) || !std::isfinite(row[r])) return false;
      const double inverse = 1 / std::sqrt(row[r]);
      for (long k = r; k < width; ++k) row[k] *= inverse;
      for (int below = r + 1; below < rows; ++below) {
        double* to = panel + below * stride;
        const double share = row[below];
        for (long k = below; k < width; ++k) to[k] -= share * row[k];
      }
    }
  }
  return true;
}

// x must have room for a panel behind its end.
void solve_rows(int size, const Panel* panels, const double* values, double* x) {
  const int count = (size + kPanel - 1) / kPanel;
  for (int number = 0; number < count; ++number) {
    const int j = kPanel * number, rows = std::min(kPanel, size - j);
    const double *a = values + panels[number].from, *b = a + panels[number].stride, *c = b + panels[number].stride,
                 *d = c + panels[number].stride;
    double* at = x + j;
    at[0] /= a[0];
    at[1] = rows > 1 ? (at[1] - at[0] * a[1]) / b[1] : 0.0;
    at[2] = rows > 2 ? ((at[2] - at[0] * a[2]) - at[1] * b[2]) / c[2] : 0.0;
    at[3] = rows > 3 ? (((at[3] - at[0] * a[3]) - at[1] * b[3]) - at[2] * c[3]) / d[3] : 0.0;
    const double x0 = at[0], x1 = at[1], x2 = at[2], x3 = at[3];
    for (long k = kPanel; j + k <= panels[number].last; k += kPanel) {
      Four to, ak, bk, ck, dk;
      get(to, at + k), get(ak, a + k), get(bk, b + k), get(ck, c + k), get(dk, d + k);
      to = (((to - x0 * ak) - x1 * bk) - x2 * ck) - x3 * dk;
      put(at + k, to);
    }
  }
  for (int number = count - 1; number >= 0; --number) {
    const int j = kPanel * number, rows = std::min(kPanel, size - j);
    const double *a = values + panels[number].from, *b = a + panels[number].stride, *c = b + panels[number].stride,
                 *d = c + panels[number].stride;
    double* at = x + j;
    Four one = {}, two = {}, three = {}, four = {};
    // Start from the far end, because the values that the panel behind found last are then needed last.
    for (long k = (panels[number].last - j) / kPanel * kPanel; k >= kPanel; k -= kPanel) {
      Four to, ak, bk, ck, dk;
      get(to, at + k), get(ak, a + k), get(bk, b + k), get(ck, c + k), get(dk, d + k);
      one += ak * to, two += bk * to, three += ck * to, four += dk * to;
    }
    if (rows > 3) at[3] = (at[3] - total(four)) / d[3];
    if (rows > 2) at[2] = ((at[2] - total(three)) - c[3] * at[3]) / c[2];
    if (rows > 1) at[1] = (((at[1] - total(two)) - b[3] * at[3]) - b[2] * at[2]) / b[1];
    at[0] = ((((at[0] - total(one)) - a[3] * at[3]) - a[2] * at[2]) - a[1] * at[1]) / a[0];
  }
}

// x and out must have room for a panel behind their ends, with zeros there; out must be zero throughout.
void multiply_rows(int size, const Panel* panels, const double* values, const double* x, double* out) {
  for (int j = 0, number = 0; j < size; j += kPanel, ++number) {
    const long stride = panels[number].stride;
    const double *a = values + panels[number].from, *b = a + stride, *c = b + stride, *d = c + stride;
    for (int r = 0; r < kPanel; ++r)
      for (int k = 0; k < kPanel; ++k) out[j + r] += (k < r ? a[k * stride + r] : a[r * stride + k]) * x[j + k];
    const double x0 = x[j], x1 = x[j + 1], x2 = x[j + 2], x3 = x[j + 3];
    Four one = {}, two = {}, three = {}, four = {};
    for (long k = kPanel; j + k <= panels[number].last; k += kPanel) {
      Four at, to, ak, bk, ck, dk;
      get(at, x + j + k), get(to, out + j + k), get(ak, a + k), get(bk, b + k), get(ck, c + k), get(dk, d + k);
      one += ak * at, two += bk * at, three += ck * at, four += dk * at;
      to += (x0 * ak + x1 * bk) + (x2 * ck + x3 * dk);
      put(out + j + k, to);
    }
    out[j] += total(one), out[j + 1] += total(two), out[j + 2] += total(three), out[j + 3] += total(four);
  }
}
