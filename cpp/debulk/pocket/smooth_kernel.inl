// The loops of smooth.cpp, which includes this file once per Isa (see core/simd_dispatch.inl). Sums stay in registers
// while they grow: when they were read from and written to memory for each term, they took five times as long. Each
// sum is added up in the same order whatever the Isa.

// As wide as a register: GCC keeps what is wider in memory.
typedef double Doubles __attribute__((vector_size(register_bytes)));
constexpr int doubles = sizeof(Doubles) / sizeof(double);
constexpr int vectors = 4;  // at once, as many as the registers hold
static_assert(kColumns % (doubles * vectors) == 0);

DEBULK_INLINE Doubles load_doubles(const double* from) {
  Doubles v;
  std::memcpy(&v, from, sizeof v);
  return v;
}

// Writes a row's heights, 0 where they are not known. Returns whether all are known.
bool widen(const float* __restrict from, int count, double* __restrict to) {
  int unknown = 0;
  for (int i = 0; i < count; ++i) {
    const float h = from[i];
    to[i] = h == h ? static_cast<double>(h) : 0.0;
    unknown |= h != h;
  }
  return unknown == 0;
}

// Writes the values that are wanted.
void put(const double* __restrict values, const std::uint8_t* __restrict wanted, int count, float* __restrict to) {
  for (int i = 0; i < count; ++i) to[i] = wanted[i] ? static_cast<float>(values[i]) : to[i];
}

// From one row's values (0 where unknown): sums over k = -half .. half of the value, and of x² times it, at each of
// `count` places. `count` must be a multiple of kColumns. values[0] is `half` to the left of the first place.
void row_sums(const double* values, const double* squares, int half, int count, double* __restrict s0, double* __restrict s2) {
  for (int i = 0; i < count; i += doubles * vectors) {
    Doubles sum[vectors] = {}, weighted[vectors] = {};
    for (int k = 0; k <= 2 * half; ++k)
      for (int v = 0; v < vectors; ++v) {
        const Doubles value = load_doubles(values + i + k + doubles * v);
        sum[v] += value;
        weighted[v] += squares[k] * value;
      }
    std::memcpy(s0 + i, sum, sizeof sum), std::memcpy(s2 + i, weighted, sizeof weighted);
  }
}

// The fit's values at the centres, from the sums of 2 half + 1 rows, starting with the first.
void fit_row(const double* const* s0, const double* const* s2, const double* c0, double c2, int half, int count, double* __restrict value) {
  for (int i = 0; i < count; i += doubles * vectors) {
    Doubles fitted[vectors] = {};
    for (int k = 0; k <= 2 * half; ++k)
      for (int v = 0; v < vectors; ++v)
        fitted[v] += c0[k] * load_doubles(s0[k] + i + doubles * v) + c2 * load_doubles(s2[k] + i + doubles * v);
    std::memcpy(value + i, fitted, sizeof fitted);
  }
}

// A window's sums from those of its rows, starting with the first. Row k lies at the distance whose powers are y[k].
void add_up(const RowMoments* const* rows, const Powers* y, int count, WindowMoments& out) {
  out.known = 0;
  for (int k = 0; k < count; ++k) out.known += rows[k]->x[0];
  constexpr int powers_of_y = sizeof(Powers) / sizeof(double);
  for (int from = 0; from < powers_of_y; from += doubles) {
    Doubles xy[5] = {}, xyh[3] = {};
    for (int k = 0; k < count; ++k) {
      const RowMoments& m = *rows[k];
      const Doubles powers = load_doubles(y[k].data() + from);
      for (int a = 0; a < 5; ++a) xy[a] += m.x[static_cast<std::size_t>(a)] * powers;
      for (int a = 0; a < 3; ++a) xyh[a] += m.xh[static_cast<std::size_t>(a)] * powers;
    }
    for (std::size_t a = 0; a < 5; ++a) std::memcpy(&out.xy[a][static_cast<std::size_t>(from)], &xy[a], sizeof xy[a]);
    for (std::size_t a = 0; a < 3; ++a) std::memcpy(&out.xyh[a][static_cast<std::size_t>(from)], &xyh[a], sizeof xyh[a]);
  }
}
