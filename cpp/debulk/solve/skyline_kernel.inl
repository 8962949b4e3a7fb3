// The loops of skyline.cpp: included there once for each Isa (see core/simd_dispatch.inl). Sums run in a fixed order.

typedef double Eight __attribute__((vector_size(64)));
constexpr int kWide = DEBULK_ISA == 4 ? 8 : DEBULK_ISA == 3 ? 4 : 2;
typedef double Wide __attribute__((vector_size(DEBULK_ISA == 4 ? 64 : DEBULK_ISA == 3 ? 32 : 16)));

DEBULK_INLINE double dot(const double* a, const double* b, long count) {
  Eight sums = {};
  long k = 0;
  for (; k + 8 <= count; k += 8) {
    Eight ak, bk;
    std::memcpy(&ak, a + k, sizeof ak), std::memcpy(&bk, b + k, sizeof bk);
    sums += ak * bk;
  }
  double rest = 0;
  for (; k < count; ++k) rest += a[k] * b[k];
  return (((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))) + rest;
}

// to -= factor * from.
DEBULK_INLINE void subtract(double* to, double factor, const double* from, long count) {
  for (long k = 0; k < count; ++k) to[k] -= factor * from[k];
}

DEBULK_INLINE Wide wide(const double* from) {
  Wide v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
DEBULK_INLINE void put(double* to, Wide v) {
  std::memcpy(to, &v, sizeof v);
}

// Takes from the rows of a panel what all panels before it have in its columns, some columns at a time, which stay in registers
// meanwhile: element by element, each in the same order, whatever the width of the instructions.
DEBULK_INLINE void eliminate(const Panel* panels, int number, double* room) {
  const int first_row = kPanel * number, last = panels[number].last;
  double* to = room + panels[number].from;
  const long stride = panels[number].stride;
  int reaches = 0;  // the first panel with anything in these columns
  for (int column = first_row; column <= last; column += kWide) {
    while (panels[reaches].last < column) ++reaches;
    const long k = column - first_row;
    Wide one = wide(to + k), two = wide(to + k + stride), three = wide(to + k + 2 * stride), four = wide(to + k + 3 * stride);
    for (int p = reaches; p < number; ++p) {
      const long step = panels[p].stride;
      const double *a = room + panels[p].from + (first_row - kPanel * p), *b = a + step, *c = b + step, *d = c + step;
      const Wide ak = wide(a + k), bk = wide(b + k), ck = wide(c + k), dk = wide(d + k);
      one -= (a[0] * ak + b[0] * bk) + (c[0] * ck + d[0] * dk);
      two -= (a[1] * ak + b[1] * bk) + (c[1] * ck + d[1] * dk);
      three -= (a[2] * ak + b[2] * bk) + (c[2] * ck + d[2] * dk);
      four -= (a[3] * ak + b[3] * bk) + (c[3] * ck + d[3] * dk);
    }
    put(to + k, one), put(to + k + stride, two), put(to + k + 2 * stride, three), put(to + k + 3 * stride, four);
  }
}

bool factor_rows(int size, const int* last, const std::size_t* start, double* values, const Panel* panels, double* room) {
  for (int j = 0, number = 0; j < size; j += kPanel, ++number) {
    const int rows = std::min(kPanel, size - j);
    double* panel = room + panels[number].from;
    const long stride = panels[number].stride, width = panels[number].last - j + 1;
    std::fill(panel, panel + kPanel * stride, 0.0);
    for (int r = 0; r < rows; ++r) std::copy_n(values + start[j + r], last[j + r] - (j + r) + 1, panel + r * stride + r);
    eliminate(panels, number, room);
    for (int r = 0; r < rows; ++r) {
      double* row = panel + r * stride;
      if (!(row[r] > 1e-14 * std::abs(values[start[j + r]])) || !std::isfinite(row[r])) return false;
      const double inverse = 1 / std::sqrt(row[r]);
      for (long k = r; k < width; ++k) row[k] *= inverse;
      for (int below = r + 1; below < rows; ++below) subtract(panel + below * stride + below, row[below], row + below, width - below);
      std::copy_n(row + r, last[j + r] - (j + r) + 1, values + start[j + r]);
    }
  }
  return true;
}

void solve_rows(int size, const int* last, const std::size_t* start, const double* values, double* x) {
  for (int i = 0; i < size; ++i) {
    const double* row = values + start[i];
    x[i] /= row[0];
    subtract(x + i + 1, x[i], row + 1, last[i] - i);
  }
  for (int i = size - 1; i >= 0; --i) {
    const double* row = values + start[i];
    x[i] = (x[i] - dot(row + 1, x + i + 1, last[i] - i)) / row[0];
  }
}

void multiply_rows(int size, const int* last, const std::size_t* start, const double* values, const double* x, double* out) {
  for (int i = 0; i < size; ++i) {
    const double* row = values + start[i];
    out[i] += dot(row, x + i, last[i] - i + 1);
    subtract(out + i + 1, -x[i], row + 1, last[i] - i);
  }
}
