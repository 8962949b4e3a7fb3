// The loops of image_gridding.cpp: included there once for each Isa, inside a namespace of its own (see core/wide.hpp).
#include "debulk/core/wide_ops.inl"

DEBULK_INLINE Floats gather(const float* from, Ints index) {
  Floats v;
  for (int k = 0; k < lanes; ++k) v[k] = from[index[k]];
  return v;
}

struct Pixels {
  Floats column, row;
};

void run(const ImageTables& t, int j, float* out) {
  const Floats first_column = all(1), last_column = all(static_cast<float>(t.width - 2));
  const Floats first_row = all(1), last_row = all(static_cast<float>(t.height - 2));
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
    const auto nearest = [](Floats v, Ints in) DEBULK_LAMBDA { return in & __builtin_convertvector(in ? v + 0.5f : all(0), Ints); };

    Pixels p = project(all(0));
    Ints in = inside(p);
    if (!any(in)) {
      for (int k = 0; k < std::min(lanes, t.nx - stretch * lanes); ++k) out[stretch * lanes + k] = nan;
      continue;
    }
    const Ints tile = (nearest(p.row, in) / tile_height) * t.tile_pitch + nearest(p.column, in) / tile_width;
    Floats h = gather(t.tiles, tile);
    h = h == h ? h : all(0);
    p = project(h), in = inside(p);
    const Floats seen = gather(t.heights, nearest(p.row, in) * t.width + nearest(p.column, in));
    p = project(seen == seen ? seen : h), in = inside(p);

    const Ints column = nearest(p.column, in), row = nearest(p.row, in);
    const Floats u = p.column - __builtin_convertvector(column, Floats), v = p.row - __builtin_convertvector(row, Floats);
    const Floats wx[3] = {0.5f * (0.5f - u) * (0.5f - u), 0.75f - u * u, 0.5f * (0.5f + u) * (0.5f + u)};
    const Floats wy[3] = {0.5f * (0.5f - v) * (0.5f - v), 0.75f - v * v, 0.5f * (0.5f + v) * (0.5f + v)};
    const Ints centre = (in & (row * t.width + column)) | (~in & (t.width + 1));
    Floats sum = {}, weights = {};
    for (int b = 0; b < 3; ++b)
      for (int a = 0; a < 3; ++a) {
        const Floats value = gather(t.heights + (b - 1) * static_cast<long>(t.width) + (a - 1), centre), w = wx[a] * wy[b];
        const Ints there = value == value;
        sum += there ? w * value : all(0);
        weights += there ? w : all(0);
      }
    const Floats height = (weights >= all(0.4f)) & in ? sum / weights : all(nan);
    if ((stretch + 1) * lanes <= t.nx) {
      store(out + stretch * lanes, height);
    } else {
      for (int k = 0; k < t.nx - stretch * lanes; ++k) out[stretch * lanes + k] = height[k];
    }
  }
}
