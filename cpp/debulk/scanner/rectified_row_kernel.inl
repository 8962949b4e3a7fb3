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
    const Ints at = j * view.width + i, beside = choose(u > 0.0f, Ints{} + 1, Ints{}),
               below = choose(v > 0.0f, Ints{} + view.width, Ints{});
    // Most groups of sixteen lie close together and have their upper pixels in one or two rows, where they are picked from
    // registers.
    const int top = std::min(j[0], j[lanes - 1]);
    const Ints k = i - i[0], second = j > top;
    const long corner = static_cast<long>(top) * view.width + i[0];
    const bool close = corner + 2L * view.width + 2 * lanes < pixels && every((((j - top) & ~1) | (k & ~(2 * lanes - 1))) == 0);
    const bool two_rows = any(second);
    Floats a = {}, b = {}, c = {}, d = {}, sigma = {};
    const auto take = [&](const auto& columns) DEBULK_LAMBDA {
      const auto near_by = [&](const float* map) DEBULK_LAMBDA {
        const Floats in_top = columns(map + corner);
        return two_rows ? choose(second, columns(map + corner + view.width), in_top) : in_top;
      };
      a = near_by(view.phase), b = choose(u > 0.0f, near_by(view.phase + 1), a);
      c = choose(v > 0.0f, near_by(view.phase + view.width), a);
      d = choose(v > 0.0f, choose(u > 0.0f, near_by(view.phase + view.width + 1), c), b);
      if (view.noise) sigma = near_by(view.noise);
    };
    // Mostly the columns come one after the other, but for a place where one is left out or comes twice.
    const int begin = std::min(0, k[lanes - 1] - (lanes - 1));
    const Ints ahead = k - (counting() + begin);
    if (close && every((ahead & ~1) == 0) && corner + begin >= 0) {
      take([&](const float* map) DEBULK_LAMBDA { return choose(ahead == 1, load(map + begin + 1), load(map + begin)); });
    } else if (close) {
      take(Near<2>(k));
    } else {
      a = gather(view.phase, at), b = gather(view.phase, at + beside);
      c = gather(view.phase, at + below), d = gather(view.phase, at + below + beside);
      if (view.noise) sigma = gather(view.noise, at);
    }
    const Floats upper = a + u * (b - a), lower_row = c + u * (d - c);
    const Floats step = higher(higher(absolute(b - a), absolute(d - c)), higher(absolute(c - a), absolute(d - b)));
    const Floats value = upper + v * (lower_row - upper);
    const Ints whole = (step <= view.edge) & (value == value);  // the step can hide a pixel without a phase
    store(phase, choose(within & whole, value, all(nan)));
    store(out.noise.data() + column, view.noise ? sigma * root((1.0f - v) * (1.0f - v) + v * v) : all(0.0f));
    store(out.fraction.data() + column, u);
    const Ints near = ((a == a) | (b == b)) & ((c == c) | (d == d));
    for (unsigned which = bits(within & ~whole & near) & ((1u << left) - 1); which != 0; which &= which - 1) {
      const int one = __builtin_ctz(which);
      bridge(view, i[one], j[one], u[one], v[one], column + one, out);
    }
  }
}
