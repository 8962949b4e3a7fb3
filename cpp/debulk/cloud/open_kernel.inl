// The loops of open_search.cpp, which includes this file once per Isa (see core/simd_dispatch.inl).

#include "debulk/cloud/nearest_four.inl"

struct Window {
  int left, right, top, bottom;  // both ends belong to the window
  DEBULK_INLINE Window over(int side_x, int side_y) const { return {left / side_x, right / side_x, top / side_y, bottom / side_y}; }
};

struct Finder {
  explicit Finder(const OpenTables& tables) : t(tables) {}

  const OpenTables& t;
  std::array<NearTile, 256> tiles;  // tiles of a window that are near enough to be visited
  int count = 0;
  std::uint32_t self = 0;
  int column = 0, row = 0;
  float p[3] = {};

  DEBULK_INLINE Floats squared(Floats x, Floats y, Floats z) const {
    const Floats dx = all(p[0]) - x, dy = all(p[1]) - y, dz = all(p[2]) - z;
    return dx * dx + dy * dy + dz * dz;
  }

  // Visits the points of a tile that are not open themselves.
  DEBULK_INLINE void visit_tile(int tx, int ty, Nearest& found) const {
    const CloudView& cloud = t.pass->cloud;
    const int first = tx * tile_width, last = std::min(cloud.height, (ty + 1) * tile_height);
    const int columns = std::min(lanes, cloud.width - first);
    for (int j = ty * tile_height; j < last; ++j) {
      const std::uint8_t* from = t.pass->states + static_cast<std::size_t>(j) * static_cast<std::size_t>(cloud.width) + first;
      Floats x = {}, y = {}, z = {};
      Ints state = Ints{} + static_cast<int>(pixel_open);
      if (columns == lanes) {
        load_points(cloud.point(first, j), x, y, z);
        state = load_ints(from);
      } else {
        for (int k = 0; k < columns; ++k) {
          const float* q = cloud.point(first + k, j);
          x[k] = q[0], y[k] = q[1], z[k] = q[2];
          state[k] = from[k];
        }
      }
      const Ints hidden = (state & static_cast<int>(pixel_open)) != 0;
      found.add(choose(hidden, all(infinity), lower(squared(x, y, z), all(infinity))));  // not seen: infinitely far away
    }
    found.tighten();
  }

  // Visits the open points of the window's bins, except the point itself. The points of a row of bins lie together in
  // memory.
  DEBULK_INLINE void visit_bins(const Window& w, Nearest& found) const {
    for (int by = w.top; by <= w.bottom; ++by) {
      const std::uint32_t* starts = t.starts + static_cast<std::size_t>(by) * static_cast<std::size_t>(t.bins_x);
      const int end = static_cast<int>(starts[w.right + 1]);
      for (int k = static_cast<int>(starts[w.left]); k < end; k += lanes) {
        const Ints index = read<Ints>(t.index + k);
        const Ints place = counting() + k;
        const Ints hidden = (place >= end) | (index == static_cast<int>(self));
        found.add(choose(hidden, all(infinity), squared(load(t.x + k), load(t.y + k), load(t.z + k))));
      }
    }
    found.tighten();
  }

  DEBULK_INLINE Window window(double reach) const {
    // Below 0 or NaN only if the scan changes meanwhile. Then it does not matter how much is searched.
    const int r = static_cast<int>(std::max(0.0, std::min(1e6, reach)));
    return {std::max(0, column - r), std::min(t.pass->cloud.width - 1, column + r), std::max(0, row - r),
            std::min(t.pass->cloud.height - 1, row + r)};
  }

  // Visits the tiles that were collected, the nearest first.
  DEBULK_INLINE void visit_tiles(Nearest& found) {
    for (int k = 0; k < count; ++k) {
      const NearTile& tile = tiles[static_cast<std::size_t>(k)];
      if (tile.bound <= found.limit) visit_tile(tile.x, tile.y, found);
    }
    count = 0;
  }

  // Visits everything in the window that can be nearer than the limit. The tiles whose boxes are not farther away than
  // the limit are collected first, because the nearest of them lowers the limit.
  DEBULK_INLINE void visit_window(const Window& pixels, Nearest& found) {
    visit_bins(pixels.over(bin_side, bin_side), found);
    const Window w = pixels.over(tile_width, tile_height);
    const Tiles& from = *t.pass->tiles;
    const Floats x = all(p[0]), y = all(p[1]), z = all(p[2]), zero = {};
    const Ints steps = counting();
    for (int ty = w.top; ty <= w.bottom; ++ty) {
      const Floats v_low = all(t.v_low[ty]), v_high = all(t.v_high[ty]);
      for (int tx = w.left; tx <= w.right; tx += lanes) {
        const std::size_t at = static_cast<std::size_t>(ty) * static_cast<std::size_t>(from.pitch) + static_cast<std::size_t>(tx);
        const Floats near = load(from.near.data() + at), far = load(from.far.data() + at);
        const Floats u_low = load(t.u_low + tx), u_high = load(t.u_high + tx);
        const Floats dx = higher(higher(lower(u_low * near, u_low * far) - x, x - higher(u_high * near, u_high * far)), zero);
        const Floats dy = higher(higher(lower(v_low * near, v_low * far) - y, y - higher(v_high * near, v_high * far)), zero);
        const Floats dz = higher(higher(near - z, z - far), zero);
        const Floats d = (dx * dx + dy * dy + dz * dz) * (1 - 1e-5f);
        unsigned close = bits((d <= all(found.limit)) & (near <= far) & (steps + tx <= w.right));
        if (close == 0) continue;
        alignas(64) float bound[lanes];
        store(bound, d);
        for (; close != 0; close &= close - 1) {
          const int k = __builtin_ctz(close);
          if (count == static_cast<int>(tiles.size())) visit_tiles(found);
          tiles[static_cast<std::size_t>(count++)] = {bound[k], tx + k, ty};
          if (bound[k] < tiles[0].bound) std::swap(tiles[0], tiles[static_cast<std::size_t>(count - 1)]);
        }
      }
    }
    visit_tiles(found);
  }

  // Number of pixels beyond which no point is nearer than the limit.
  DEBULK_INLINE double reach(float limit) const {
    return std::ceil(std::sqrt(static_cast<double>(limit)) * (1 + 1e-5) * t.pass->camera.f / static_cast<double>(p[2]) * t.stretch +
                     2 * t.pass->tolerance);
  }

  // The mean distance to the nearest four, or a lower bound of it that is above `enough`. All that lies within the
  // radius is visited, so what is not found there is farther away. The radius is widened until that settles it.
  DEBULK_INLINE float find(std::uint32_t k) {
    self = t.index[k];
    column = static_cast<int>(self % static_cast<std::uint32_t>(t.pass->cloud.width));
    row = static_cast<int>(self / static_cast<std::uint32_t>(t.pass->cloud.width));
    p[0] = t.x[k], p[1] = t.y[k], p[2] = t.z[k];
    float square = std::max(t.radius * t.radius, std::numeric_limits<float>::min());
    for (float wider = 4;; square *= wider, wider *= 4) {  // infinite after a few steps, which ends it
      Nearest found;
      const float limit = found.limit = std::min(square, t.limit[k]);
      visit_window(window(reach(limit)), found);
      const bool complete = !(found.fourth() > limit);
      const float mean = found.mean(limit);
      if (complete || mean > t.enough) return mean;
    }
  }
};

void run(const OpenTables& tables, long begin, long end, float* distances) {
  Finder finder(tables);
  for (std::uint32_t k = tables.starts[begin]; k < tables.starts[end]; ++k)
    if ((k % tables.every == 0) == tables.multiples) distances[k] = finder.find(k);
}
