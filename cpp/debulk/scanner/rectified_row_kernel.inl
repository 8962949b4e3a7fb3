// The loop of rectified_row.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

void run(const PhaseView& view, int row, RectifiedRow& out) {
  const long first = static_cast<long>(row) * view.rectified_width, pixels = static_cast<long>(view.width) * view.height;
  const Floats right = all(static_cast<float>(view.width - 1)), bottom = all(static_cast<float>(view.height - 1));
  for (int column = 0; column < view.rectified_width; column += lanes) {
    const int left = std::min(lanes, view.rectified_width - column);
    Floats x = {}, y = {};
    if (left == lanes) {
      x = load(view.map_x + first + column), y = load(view.map_y + first + column);
    } else {
      float padded[2][lanes] = {};
      std::copy_n(view.map_x + first + column, left, padded[0]), std::copy_n(view.map_y + first + column, left, padded[1]);
      x = load(padded[0]), y = load(padded[1]);
    }
    const Ints within = (x >= 0.0f) & (x <= right) & (y >= 0.0f) & (y <= bottom);
    float* phase = out.phase.data() + column;
    if (!any(within)) {
      store(phase, all(nan));
      continue;
    }
    x = choose(within, x, all(0.0f)), y = choose(within, y, all(0.0f));
    Ints i = converted<Ints>(x), j = converted<Ints>(y);
    Floats u = x - converted<Floats>(i), v = y - converted<Floats>(j);
    const Ints next_x = u > 1.0f - nearly_whole, next_y = v > 1.0f - nearly_whole;
    i -= next_x, j -= next_y;
    u = choose(next_x | (u < nearly_whole), all(0.0f), u);
    v = choose(next_y | (v < nearly_whole), all(0.0f), v);
    const Ints at = j * view.width + i, beside = choose(u > 0.0f, Ints{} + 1, Ints{}), below = choose(v > 0.0f, Ints{} + view.width, Ints{});
    // Most groups of sixteen lie in two rows and close together, where they are picked from registers.
    const Ints k = i - i[0];
    const long corner = at[0];
    const bool close = corner + view.width + 2 * lanes <= pixels && every((j == Ints{} + j[0]) & (k >= 0) & (k < 2 * lanes - 1));
    Floats a = {}, b = {}, c = {}, d = {};
    if (close) {
      const float *here = view.phase + corner, *next = here + view.width;
      a = pick<2>(here, k), b = pick<2>(here, k + beside);
      c = choose(v > 0.0f, pick<2>(next, k), a), d = choose(v > 0.0f, pick<2>(next, k + beside), b);
    } else {
      a = gather(view.phase, at), b = gather(view.phase, at + beside);
      c = gather(view.phase, at + below), d = gather(view.phase, at + below + beside);
    }
    const Floats upper = a + u * (b - a), lower_row = c + u * (d - c);
    const Floats step = higher(higher(absolute(b - a), absolute(d - c)), higher(absolute(c - a), absolute(d - b)));
    const Floats value = upper + v * (lower_row - upper);
    const Ints whole = (step <= view.edge) & (value == value);  // the step can hide a pixel without a phase
    store(phase, choose(within & whole, value, all(nan)));
    if (view.noise) {
      const Floats sigma = close ? pick<2>(view.noise + corner, k) : gather(view.noise, at);
      store(out.noise.data() + column, sigma * root((1.0f - v) * (1.0f - v) + v * v));
    } else {
      store(out.noise.data() + column, all(0.0f));
    }
    store(out.fraction.data() + column, u);
    const Ints near = ((a == a) | (b == b)) & ((c == c) | (d == d));
    for (unsigned which = bits(within & ~whole & near) & ((1u << left) - 1); which != 0; which &= which - 1) {
      const int one = __builtin_ctz(which);
      bridge(view, i[one], j[one], u[one], v[one], column + one, out);
    }
  }
}
