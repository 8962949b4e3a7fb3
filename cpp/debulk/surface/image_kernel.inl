// The loops of image_gridding.cpp: included there once for each Isa (see core/each_isa.inl).

struct Pixels {
  Floats column, row;
};

// Where sixteen nodes look in an image of `pitch` values a row. Most look into two rows and a few neighbouring columns, in
// which shuffles find the values many times faster than loads one by one.
struct Places {
  const float* image;
  long pitch;
  Ints column, row;
  int left = 0, top = 0;
  bool close = false;

  template <int N>  // within 16 N columns, `margin` kept on both sides
  DEBULK_INLINE void look_closely(int margin) {
#if DEBULK_ISA == 4
    left = std::max(0, std::min(column[0], column[lanes - 1]) - 4), top = std::min(row[0], row[lanes - 1]);
    const Ints i = column - left, j = row - top;
    close = every((i >= margin) & (i < lanes * N - margin) & ((j & ~1) == 0));
#else
    (void)margin;
#endif
  }
  // The values `down` rows lower and `right` columns to the right.
  template <int N>
  DEBULK_INLINE Floats values(int down, int right) const {
    if (!close) return gather(image + down * pitch + right, row * static_cast<int>(pitch) + column);
    return row == top ? line<N>(down, right) : line<N>(down + 1, right);
  }
  // The same of row `top`, if close.
  template <int N>
  DEBULK_INLINE Floats line(int down, int right) const {
    return pick<N>(image + (top + down) * pitch + left, column - left + right);
  }
};

template <int N>
DEBULK_INLINE Floats look_up(const float* image, int pitch, Ints column, Ints row) {
  Places at{image, pitch, column, row};
  at.look_closely<N>(0);
  return at.values<N>(0, 0);
}

// A mean of the nine values round the places, with weights; NaN counts nothing.
DEBULK_INLINE Floats smooth(const Places& at, const Floats* wx, const Floats* wy) {
  Floats sum = {}, weights = {};
  const auto add = [&](Floats value, Floats w) DEBULK_LAMBDA {
    const Ints there = value == value;
    sum += there ? w * value : all(0);
    weights += there ? w : all(0);
  };
  if (at.close) {
    for (int a = 0; a < 3; ++a) {
      Floats lines[4];
      for (int b = 0; b < 4; ++b) lines[b] = at.line<3>(b - 1, a - 1);
      for (int b = 0; b < 3; ++b) add(at.row == at.top ? lines[b] : lines[b + 1], wx[a] * wy[b]);
    }
  } else {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) add(at.values<3>(b - 1, a - 1), wx[a] * wy[b]);
  }
  return weights >= all(0.4f) ? sum / weights : all(nan);
}

void run(const ImageTables& t, int j, float* out) {
  const Floats first_column = all(static_cast<float>(t.left + 1)), last_column = all(static_cast<float>(t.left + t.width - 2));
  const Floats first_row = all(static_cast<float>(t.top + 1)), last_row = all(static_cast<float>(t.top + t.height - 2));
  const Floats steps = Floats{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15} / lanes;
  for (int stretch = 0; stretch * lanes < t.nx; ++stretch) {
    const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(t.across) + static_cast<std::size_t>(stretch);
    const Floats x = t.x[at] + steps * (t.x[at + 1] - t.x[at]), y = t.y[at] + steps * (t.y[at + 1] - t.y[at]);
    const Floats z = t.z[at] + steps * (t.z[at + 1] - t.z[at]);
    const auto project = [&](Floats h) DEBULK_LAMBDA {
      const Floats scale = t.f / (z + h * t.up[2]);
      return Pixels{t.cx + (x + h * t.up[0]) * scale, t.cy + (y + h * t.up[1]) * scale};
    };
    const auto inside = [&](const Pixels& p) DEBULK_LAMBDA {
      return (p.column >= first_column) & (p.column <= last_column) & (p.row >= first_row) & (p.row <= last_row);
    };
    // Who is outside looks to the first inner pixel, and takes nothing from there.
    const auto near_column = [&](const Pixels& q, Ints in)
                                 DEBULK_LAMBDA { return __builtin_convertvector(in ? q.column + 0.5f : first_column, Ints) - t.left; };
    const auto near_row = [&](const Pixels& q, Ints in)
                              DEBULK_LAMBDA { return __builtin_convertvector(in ? q.row + 0.5f : first_row, Ints) - t.top; };

    Pixels p = project(all(0));
    Ints in = inside(p);
    if (!any(in)) {
      for (int k = 0; k < std::min(lanes, t.nx - stretch * lanes); ++k) out[stretch * lanes + k] = nan;
      continue;
    }
    const Floats coarse = look_up<1>(t.tiles, t.tile_pitch, near_column(p, in) / tile_width, near_row(p, in) / tile_height);
    const Floats h = coarse == coarse ? coarse : all(0);
    p = project(h), in = inside(p);
    const Floats seen = look_up<3>(t.heights, t.width, near_column(p, in), near_row(p, in));
    p = project(seen == seen ? seen : h), in = inside(p);

    Places centre{t.heights, t.width, near_column(p, in), near_row(p, in)};
    centre.look_closely<3>(1);
    const Floats u = p.column - __builtin_convertvector(centre.column + t.left, Floats);
    const Floats v = p.row - __builtin_convertvector(centre.row + t.top, Floats);
    const Floats wx[3] = {0.5f * (0.5f - u) * (0.5f - u), 0.75f - u * u, 0.5f * (0.5f + u) * (0.5f + u)};
    const Floats wy[3] = {0.5f * (0.5f - v) * (0.5f - v), 0.75f - v * v, 0.5f * (0.5f + v) * (0.5f + v)};
    const Floats found = smooth(centre, wx, wy), height = in ? found : all(nan);
    if ((stretch + 1) * lanes <= t.nx) {
      store(out + stretch * lanes, height);
    } else {
      for (int k = 0; k < t.nx - stretch * lanes; ++k) out[stretch * lanes + k] = height[k];
    }
  }
}
