// The loops of window_pass.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).
#include "debulk/cloud/nearest_four.inl"

constexpr int strip = 640;  // columns at once, so that their data stay in the first-level cache
constexpr int margin = 32;  // columns to the left and right of a strip, of which the nearest 16 are its neighbours
constexpr int wide_row = strip + 2 * margin;

// Squared distances of a row's points to four of their neighbours. The other four are stored with those neighbours.
struct Links {
  alignas(64) float right[wide_row], left_below[wide_row], below[wide_row], right_below[wide_row];
};
struct Row {
  alignas(64) float x[wide_row], y[wide_row], z[wide_row];
};

// Points of a row of tiles that the window left open: their places, their depths, and the nearest four of the square
// round them.
struct Doubtful {
  static constexpr int most = strip * tile_height;
  int count = 0;
  std::uint32_t index[most];
  int place[most];  // in the strip's arrays
  alignas(64) float z[most], nearest[4][most];
};

struct Strip {
  Doubtful doubtful;
  Row rows[2];
  Links links[2];
  alignas(64) float u[wide_row], u_bound[wide_row];
  // The base along one row of its nodes, and the difference to the next row of nodes.
  alignas(64) float base[wide_row], base_more[wide_row], gain[wide_row], gain_more[wide_row];
  alignas(64) float near[wide_row], far[wide_row], sum[wide_row], count[wide_row];  // of a row of tiles, lane by lane
};

// The squared distance, for a point at depth 1, of the plane beyond a window that reaches `reach` pixels, less a
// little for rounding.
float bound(double at, int reach, const WindowPass& pass) {
  const double s = (reach + 1 - 2 * pass.tolerance) / pass.camera.f, far = std::abs(at) + (reach + 1) / pass.camera.f;
  return static_cast<float>(s * s / (1 + far * far) * (1 - 1e-5));
}

// Loads one row of the strip. Points that were not seen are infinitely far away. Position `margin` of `row` is column
// `first`.
DEBULK_INLINE void load_row(const CloudView& cloud, int at, int first, int columns, Row& row) {
  for (int k = margin - lanes; k < margin + columns + lanes; k += lanes) {
    const int column = first + k - margin;
    Floats x = all(nan), y = x, z = x;
    if (at >= 0 && at < cloud.height && column >= 0 && column + lanes <= cloud.width) {
      load_points(cloud.point(column, at), x, y, z);
      const char* soon = reinterpret_cast<const char*>(cloud.point(column, std::min(at + 1, cloud.height - 1)));
      for (int i = 0; i < 3; ++i) __builtin_prefetch(soon + 64 * i);
    } else {
      for (int i = 0; i < lanes; ++i) {
        if (at < 0 || at >= cloud.height || column + i < 0 || column + i >= cloud.width) continue;
        const float* p = cloud.point(column + i, at);
        x[i] = p[0], y[i] = p[1], z[i] = p[2];
      }
    }
    const Floats sum = x + y + z;
    const Ints seen = sum - sum == 0;
    store(row.x + k, choose(seen, x, all(infinity)));
    store(row.y + k, choose(seen, y, all(0))), store(row.z + k, choose(seen, z, all(0)));
  }
}

DEBULK_INLINE Floats squared(const Row& a, int i, const Row& b, int j) {
  const Floats dx = load(a.x + i) - load(b.x + j), dy = load(a.y + i) - load(b.y + j), dz = load(a.z + i) - load(b.z + j);
  return dx * dx + dy * dy + dz * dz;
}

DEBULK_INLINE void link(const Row& row, const Row& next, int columns, Links& out) {
  for (int k = margin - lanes; k < margin + columns + lanes; k += lanes) {
    store(out.right + k, squared(row, k, row, k + 1));
    store(out.left_below + k, squared(row, k, next, k - 1));
    store(out.below + k, squared(row, k, next, k));
    store(out.right_below + k, squared(row, k, next, k + 1));
  }
}

DEBULK_INLINE void sort(Floats* a) {
  order(a[0], a[1]), order(a[2], a[3]), order(a[0], a[2]), order(a[1], a[3]), order(a[1], a[2]);
}
// The mean of four distances that are given squared.
DEBULK_INLINE Floats mean_root(const Floats* squares) {
  return ((root(squares[0]) + root(squares[1])) + (root(squares[2]) + root(squares[3]))) * 0.25f;
}

// Adds the lanes of two sums and three counts to the band's.
DEBULK_INLINE void add_up(Floats sum, Floats squares, Ints certain, Ints seen, Ints strays, WindowBand& out) {
  alignas(64) float a[lanes], b[lanes];
  alignas(64) int c[lanes], d[lanes], e[lanes];
  store(a, sum), store(b, squares);
  write(c, certain), write(d, seen), write(e, strays);
  for (int k = 0; k < lanes; ++k) {
    out.sum += a[k], out.squares += b[k];
    out.certain -= c[k], out.seen -= d[k], out.strays -= e[k];
  }
}

// Decides the row's points. above, here: the links of the row above and of this row.
DEBULK_INLINE void decide(const WindowPass& pass, int at, int first, int columns, const Row& row, const Links& above, const Links& here,
                          Strip& s, std::uint8_t* states, float* heights, WindowBand& out) {
  const std::uint32_t index =
      static_cast<std::uint32_t>(at) * static_cast<std::uint32_t>(pass.cloud.width) + static_cast<std::uint32_t>(first);
  int places[strip + lanes], distances[strip + lanes], count = 0;  // of pixels that are to be resolved; bits of a float
  const Pinhole& camera = pass.camera;
  const Floats v = all(static_cast<float>(camera.v(at))), v_bound = all(bound(camera.v(at), 1, pass));
  const Floats slack = all(static_cast<float>(pass.tolerance / camera.f));
  const Floats low = all(static_cast<float>(pass.low)), high = all(static_cast<float>(pass.high));
  const Floats down = all(pass.base ? static_cast<float>(at % pass.base->step) / static_cast<float>(pass.base->step) : 0);
  Floats sum = {}, squares = {};
  Ints certain = {}, seen = {}, strays = {};
  for (int k = margin; k < margin + columns; k += lanes) {
    Floats a[4] = {load(here.right + k), load(here.left_below + k), load(here.below + k), load(here.right_below + k)};
    Floats b[4] = {load(here.right + k - 1), load(above.left_below + k + 1), load(above.below + k), load(above.right_below + k - 1)};
    sort(a), sort(b);
    const Floats nearest[4] = {lower(a[0], b[3]), lower(a[1], b[2]), lower(a[2], b[1]), lower(a[3], b[0])};
    const Floats fourth = higher(higher(nearest[0], nearest[1]), higher(nearest[2], nearest[3]));
    const Floats x = load(row.x + k), y = load(row.y + k), z = load(row.z + k);
    const Ints here_seen = x < all(infinity);
    const Ints placed = (absolute(x - load(s.u + k) * z) <= slack * z) & (absolute(y - v * z) <= slack * z);
    const Ints sure = (fourth <= lower(load(s.u_bound + k), v_bound) * (z * z)) & here_seen;
    const Floats distance = mean_root(nearest);
    const Floats counted = choose(sure, distance, all(0));
    sum += counted, squares += counted * counted;
    certain += sure, seen += here_seen, strays += here_seen & ~placed;

    const Ints close = choose(distance > high, Ints{}, Ints{} + static_cast<int>(pixel_close));
    const Ints decided = choose(distance <= low, Ints{} + 1, close);
    const unsigned noted = bits(here_seen & (~sure | (decided == static_cast<int>(pixel_close))));
    pack(as<Ints>(distance), noted, distances + count);
    count += pack(counting() + k, noted, places + count);
    const Ints state = here_seen & choose(sure, decided, Ints{} + static_cast<int>(pixel_open));
    store_bytes(states + (k - margin), state);
    store(s.near + k, lower(choose(sure, z, all(infinity)), load(s.near + k)));
    store(s.far + k, higher(choose(sure, z, all(-infinity)), load(s.far + k)));
    if (heights) {
      const Floats base = load(s.base + k) + down * load(s.base_more + k), gain = load(s.gain + k) + down * load(s.gain_more + k);
      const Floats height = (z - base) * gain;
      store(heights + (k - margin), choose(state != 0, height, all(nan)));
      const Ints steady = sure & (decided != 0) & (height == height);
      store(s.sum + k, load(s.sum + k) + choose(steady, height, all(0)));
      store(s.count + k, load(s.count + k) + choose(steady, all(1), all(0)));
    }
  }
  add_up(sum, squares, certain, seen, strays, out);
  for (int n = 0; n < count; ++n) {
    const std::uint32_t pixel = index + static_cast<std::uint32_t>(places[n] - margin);
    float distance;
    std::memcpy(&distance, distances + n, sizeof distance);
    if (states[places[n] - margin] == pixel_close) {
      out.close.push_back({pixel, distance});
    } else {
      s.doubtful.index[s.doubtful.count] = pixel;
      s.doubtful.place[s.doubtful.count++] = places[n];
    }
  }
}

// Interpolates the base's depths and gains along one row of its nodes, which are at most sixteen pixels apart. What a
// vector holds beyond the next node is overwritten from there.
DEBULK_INLINE void spread(const RayBase& base, int row, int first, int columns, Strip& s) {
  const int step = base.step;
  const Floats w = converted<Floats>(counting()) / static_cast<float>(step);
  const auto along = [&](const std::vector<float>& values, std::size_t i, int k, float* to, float* more) DEBULK_LAMBDA {
    const float *here = &values[i], *below = here + base.nx;
    const Floats value = here[0] + w * (here[1] - here[0]);
    store(to + k, value), store(more + k, below[0] + w * (below[1] - below[0]) - value);
  };
  for (int k = 0; k < columns; k += step) {
    const std::size_t i = static_cast<std::size_t>(row) * static_cast<std::size_t>(base.nx) + static_cast<std::size_t>((first + k) / step);
    along(base.depth, i, margin + k, s.base, s.base_more);
    along(base.gain, i, margin + k, s.gain, s.gain_more);
  }
}

DEBULK_INLINE void finish_tiles(const WindowPass& pass, int at, int first, int columns, Strip& s) {
  Tiles& tiles = *pass.tiles;
  const std::size_t row = static_cast<std::size_t>(at / tile_height) * static_cast<std::size_t>(tiles.pitch);
  for (int k = 0; k < columns; k += lanes) {
    const std::size_t tile = row + static_cast<std::size_t>((first + k) / tile_width);
    const int m = margin + k;
    tiles.near[tile] = lowest(load(s.near + m));
    tiles.far[tile] = highest(load(s.far + m));
    const float sum = total(load(s.sum + m));
    const float count = total(load(s.count + m));
    tiles.mean_height[tile] = count > 0 ? sum / count : nan;
    store(s.near + m, all(infinity)), store(s.far + m, all(-infinity));
    store(s.sum + m, all(0)), store(s.count + m, all(0));
  }
}

#if DEBULK_ISA == 4
using InSquare = Nearest;
#else
using HalfFloats = decltype(Floats::low);
using InSquare = NearestIn<HalfFloats>;
#endif

// Visits all points of the square of 5 by 5 pixels round a pixel. The square must lie within the image, and
// not at the image's end.
DEBULK_INLINE void visit_square(const CloudView& cloud, int column, int row, InSquare& found) {
  const float* p = cloud.point(column, row);
  const auto squared = [&](auto x, auto y, auto z) DEBULK_LAMBDA {
    const auto dx = p[0] - x, dy = p[1] - y, dz = p[2] - z;
    return dx * dx + dy * dy + dz * dz;
  };
#if DEBULK_ISA == 4
  Floats rows[5];
  for (int j = 0; j < 5; ++j) rows[j] = load(cloud.point(column - 2, row - 2 + j));
  // One coordinate of three rows, then of two. The point itself and the unused lanes are made infinitely far away.
  const auto coordinate = [&](int a, const Floats* v) DEBULK_LAMBDA {
    const Ints two = Ints{0, 3, 6, 9, 12, 16, 19, 22, 25, 28, 16, 16, 16, 16, 16, 16} + a;
    const Ints three =
        Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 16} + Ints{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1} * a;
    return __builtin_shuffle(__builtin_shuffle(v[0], v[1], two), v[2], three);
  };
  const Ints lane = counting();
  const Floats above = squared(coordinate(0, rows), coordinate(1, rows), coordinate(2, rows));
  const Floats last[3] = {rows[3], rows[4], rows[4]};
  const Floats below = squared(coordinate(0, last), coordinate(1, last), coordinate(2, last));
  found.add(choose((lane == 12) | (lane == 15), all(infinity), lower(above, all(infinity))));
  found.add(choose(lane >= 10, all(infinity), lower(below, all(infinity))));
#else
  // One row at a time, eight points, of which five count, and in the middle row not the point itself.
  static constexpr int hidden[2][8] = {{0, 0, 0, 0, 0, -1, -1, -1}, {0, 0, -1, 0, 0, -1, -1, -1}};
  const HalfFloats none = infinity - HalfFloats{};
  for (int j = 0; j < 5; ++j) {
    HalfFloats x, y, z;
    load_points(cloud.point(column - 2, row - 2 + j), x, y, z);
    const HalfFloats d = squared(x, y, z);
    found.add(choose(read<decltype(x < y)>(hidden[j == 2]) | ~(d < none), none, d));
  }
#endif
}

// Gives the doubtful points of a row of tiles their second chance: first all distances are computed, then what follows
// from them.
DEBULK_INLINE void resolve(const WindowPass& pass, Strip& s, WindowBand& out) {
  const CloudView& cloud = pass.cloud;
  Doubtful& d = s.doubtful;
  const auto width = static_cast<std::uint32_t>(cloud.width);
  for (int k = 0; k < d.count; ++k) {
    const int column = static_cast<int>(d.index[k] % width), row = static_cast<int>(d.index[k] / width);
    const auto inside = [](int at, int size) DEBULK_LAMBDA { return at >= 2 && at + 3 < size; };
    InSquare found;
    if (inside(column, cloud.width) && inside(row, cloud.height)) visit_square(cloud, column, row, found), found.fourth();
    for (int n = 0; n < 4; ++n) d.nearest[n][k] = found.least[n][0];
    d.z[k] = cloud.point(column, row)[2];
  }
  const Pinhole& camera = pass.camera;
  const double widest = std::max(
      {std::abs(camera.u(0)), std::abs(camera.u(cloud.width - 1.0)), std::abs(camera.v(0)), std::abs(camera.v(cloud.height - 1.0))});
  const float reach = pass.certified ? bound(widest, 2, pass) : std::numeric_limits<float>::max();
  const float low = static_cast<float>(pass.low), high = static_cast<float>(pass.high);
  for (int k = 0; k < d.count; k += lanes) {
    const Floats nearest[4] = {load(d.nearest[0] + k), load(d.nearest[1] + k), load(d.nearest[2] + k), load(d.nearest[3] + k)};
    const Floats z = load(d.z + k), distance = mean_root(nearest);
    const unsigned sure = bits((nearest[3] < all(infinity)) & (nearest[3] <= reach * (z * z)));
    for (int i = k; i < std::min(d.count, k + lanes); ++i) {
      const int lane = i - k, place = d.place[i];
      const std::uint32_t index = d.index[i];
      if ((sure >> lane & 1) == 0) {
        const float* p = cloud.point(index);
        out.open.push_back({index, p[0], p[1], p[2], d.nearest[3][i]});
        continue;
      }
      const float mean = distance[lane];
      out.sum += mean, out.squares += static_cast<double>(mean) * mean, ++out.certain;
      s.near[place] = std::min(s.near[place], d.z[i]), s.far[place] = std::max(s.far[place], d.z[i]);
      pass.states[index] = mean <= low ? pixel_kept : mean > high ? pixel_removed : pixel_close;
      if (pass.states[index] == pixel_close) out.close.push_back({index, mean});
      if (pass.states[index] == pixel_removed && pass.base) pass.heights[index] = nan;
    }
  }
  d.count = 0;
}

DEBULK_INLINE void pass_strip(const WindowPass& pass, int begin, int end, int first, int columns, Strip& s, WindowBand& out) {
  const CloudView& cloud = pass.cloud;
  const int padded = (columns + lanes - 1) / lanes * lanes;
  for (int k = 0; k < wide_row; ++k) {
    const double u = pass.camera.u(first + k - margin);
    s.u[k] = static_cast<float>(u), s.u_bound[k] = bound(u, 1, pass);
    s.near[k] = infinity, s.far[k] = -infinity, s.sum[k] = s.count[k] = 0;
    s.base[k] = s.base_more[k] = s.gain[k] = s.gain_more[k] = nan;
  }
  for (Row& row : s.rows)
    for (int k = 0; k < wide_row; ++k) row.x[k] = infinity, row.y[k] = row.z[k] = 0;

  alignas(64) std::uint8_t states[strip];
  alignas(64) float heights[strip];
  load_row(cloud, begin - 1, first, padded, s.rows[(begin + 1) & 1]);
  load_row(cloud, begin, first, padded, s.rows[begin & 1]);
  link(s.rows[(begin + 1) & 1], s.rows[begin & 1], padded, s.links[(begin + 1) & 1]);
  for (int at = begin; at < end; ++at) {
    const int odd = at & 1;
    const Row& row = s.rows[odd];
    Row& next = s.rows[1 - odd];
    load_row(cloud, at + 1, first, padded, next);
    link(row, next, padded, s.links[odd]);
    if (pass.base && at % pass.base->step == 0) spread(*pass.base, at / pass.base->step, first, columns, s);
    const std::size_t index = static_cast<std::size_t>(at) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(first);
    const bool whole = padded == columns;  // a last vector that reaches beyond the columns goes through a buffer
    std::uint8_t* to_states = whole ? pass.states + index : states;
    float* to_heights = pass.base ? (whole ? pass.heights + index : heights) : nullptr;
    decide(pass, at, first, padded, row, s.links[1 - odd], s.links[odd], s, to_states, to_heights, out);
    if (!whole) {
      std::memcpy(pass.states + index, states, static_cast<std::size_t>(columns));
      if (pass.base) std::memcpy(pass.heights + index, heights, static_cast<std::size_t>(columns) * sizeof(float));
    }
    if ((at + 1) % tile_height != 0 && at + 1 != end) continue;
    resolve(pass, s, out);
    finish_tiles(pass, at, first, padded, s);
  }
}

void run(const WindowPass& pass, int band, WindowBand& out) {
  Strip s;
  out.clear();
  const int begin = band * band_rows, end = std::min(pass.cloud.height, begin + band_rows);
  for (int first = 0; first < pass.cloud.width; first += strip)
    pass_strip(pass, begin, end, first, std::min(strip, pass.cloud.width - first), s, out);
}
