// The loops of image_gridding.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

struct Pixels {
  Floats column, row;
};

// The places of sixteen nodes in an image of `pitch` values per row. Most of them lie in two rows and a few
// neighbouring columns; there, shuffles find the values many times faster than single loads.
struct Places {
  const float* image;
  long pitch;
  Ints column, row;
  int left = 0, top = 0;
  bool close = false;

  template <int N>  // within 16 N columns, with `margin` kept on both sides
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
    return choose(row == top, line<N>(down, right), line<N>(down + 1, right));
  }
  // The same in row `top`, if the places are close.
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

// The weighted mean of the nine values round the places. NaN is left out.
DEBULK_INLINE Floats smooth(const Places& at, const Floats* wx, const Floats* wy) {
  Floats sum = {}, weights = {};
  const auto add = [&](Floats value, Floats w) DEBULK_LAMBDA {
    const Ints there = value == value;
    sum += choose(there, w * value, all(0));
    weights += choose(there, w, all(0));
  };
  if (at.close) {
    for (int a = 0; a < 3; ++a) {
      Floats lines[4];
      for (int b = 0; b < 4; ++b) lines[b] = at.line<3>(b - 1, a - 1);
      for (int b = 0; b < 3; ++b) add(choose(at.row == at.top, lines[b], lines[b + 1]), wx[a] * wy[b]);
    }
  } else {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) add(at.values<3>(b - 1, a - 1), wx[a] * wy[b]);
  }
  return choose(weights >= all(0.4f), sum / weights, all(nan));
}

// Sixteen consecutive nodes of a row.
struct Nodes {
  const ImageTables& t;
  Floats x, y, z;

  DEBULK_INLINE Nodes(const ImageTables& tables, int j, int stretch) : t(tables) {
    const Floats steps = converted<Floats>(counting()) / lanes;
    const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(t.across) + static_cast<std::size_t>(stretch);
    x = t.x[at] + steps * (t.x[at + 1] - t.x[at]), y = t.y[at] + steps * (t.y[at + 1] - t.y[at]);
    z = t.z[at] + steps * (t.z[at + 1] - t.z[at]);
  }
  // The pixels at which the nodes are seen at these heights.
  DEBULK_INLINE Pixels project(Floats h) const {
    const Floats scale = t.f / (z + h * t.up[2]);
    return {t.cx + (x + h * t.up[0]) * scale, t.cy + (y + h * t.up[1]) * scale};
  }
};

// Whole numbers of pixels. A node whose pixel is outside reads the first inner pixel, but that value is not used.
struct Nearest {
  Ints in, column, row;

  DEBULK_INLINE Nearest(const ImageTables& t, const Pixels& p) {
    const Floats first_column = all(1), last_column = all(static_cast<float>(t.width - 2));
    const Floats first_row = all(1), last_row = all(static_cast<float>(t.height - 2));
    in = (p.column >= first_column) & (p.column <= last_column) & (p.row >= first_row) & (p.row <= last_row);
    column = converted<Ints>(choose(in, p.column + 0.5f, first_column));
    row = converted<Ints>(choose(in, p.row + 0.5f, first_row));
  }
};

// Does each of the three lookups for many stretches in turn, because the three lookups of one stretch wait for each
// other.
void run(const ImageTables& t, int j, float* out) {
  constexpr int most = 32;  // stretches at once
  alignas(64) float heights[most * lanes];
  for (int begin = 0; begin * lanes < t.nx; begin += most) {
    const int count = std::min(most, (t.nx + lanes - 1) / lanes - begin);
    for (int k = 0; k < count; ++k) {
      const Nearest at(t, Nodes(t, j, begin + k).project(all(0)));
      const Floats mean = any(at.in) ? look_up<1>(t.tiles, t.tile_pitch, at.column / tile_width, at.row / tile_height) : all(nan);
      store(heights + k * lanes, choose(at.in & (mean == mean), mean, all(0)));
    }
    for (int k = 0; k < count; ++k) {
      const Floats h = load(heights + k * lanes);
      const Nearest at(t, Nodes(t, j, begin + k).project(h));
      const Floats seen = any(at.in) ? look_up<3>(t.heights, t.width, at.column, at.row) : all(nan);
      store(heights + k * lanes, choose(at.in & (seen == seen), seen, h));
    }
    for (int k = 0; k < count; ++k) {
      const Pixels p = Nodes(t, j, begin + k).project(load(heights + k * lanes));
      const Nearest at(t, p);
      Floats height = all(nan);
      if (any(at.in)) {
        Places centre{t.heights, t.width, at.column, at.row};
        centre.look_closely<3>(1);
        const Floats u = p.column - converted<Floats>(centre.column);
        const Floats v = p.row - converted<Floats>(centre.row);
        const Floats wx[3] = {0.5f * (0.5f - u) * (0.5f - u), 0.75f - u * u, 0.5f * (0.5f + u) * (0.5f + u)};
        const Floats wy[3] = {0.5f * (0.5f - v) * (0.5f - v), 0.75f - v * v, 0.5f * (0.5f + v) * (0.5f + v)};
        const Floats found = smooth(centre, wx, wy);
        height = choose(at.in, found, all(nan));
      }
      store(heights + k * lanes, height);
    }
    std::copy_n(heights, std::min(count * lanes, t.nx - begin * lanes), out + begin * lanes);
  }
}
