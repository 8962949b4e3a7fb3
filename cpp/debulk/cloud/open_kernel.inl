// The loops of open_search.cpp: included there once for each Isa, inside a namespace of its own (see core/wide.hpp).
#include "debulk/core/wide_ops.inl"

// The four smallest squared distances so far of each lane, and so the four smallest of all, without a branch.
struct Nearest {
  Floats least[4];
  float limit;  // not below the fourth of all

  DEBULK_INLINE explicit Nearest(float known = infinity) : limit(known) {
    for (Floats& kept : least) kept = all(infinity);
  }
  DEBULK_INLINE void add(Floats d) {
    for (Floats& kept : least) {
      const Floats low = lower(d, kept);
      d = higher(d, kept), kept = low;
    }
  }
  // The largest of the minima of four disjoint sets.
  DEBULK_INLINE void tighten() {
    Floats m = least[0];
    m = lower(m, swapped<8>(m)), m = lower(m, swapped<4>(m));
    m = higher(m, swapped<2>(m)), m = higher(m, swapped<1>(m));
    limit = m[0] < limit ? m[0] : limit;
  }
  // The fourth of all; their mean distance if they are four.
  DEBULK_INLINE float fourth(float& mean) {
    tighten();
    float squares[4] = {infinity, infinity, infinity, infinity};
    for (const Floats& kept : least) {
      if (!any(kept <= all(limit))) break;
      alignas(64) float values[lanes];
      store(values, kept);
      for (int n = 0; n < lanes; ++n) {
        if (!(values[n] < squares[3])) continue;
        int k = 3;
        for (; k > 0 && squares[k - 1] > values[n]; --k) squares[k] = squares[k - 1];
        squares[k] = values[n];
      }
    }
    double sum = 0;
    for (const float square : squares) sum += std::sqrt(static_cast<double>(square));
    mean = static_cast<float>(sum / 4);
    return squares[3];
  }
};

struct Window {
  int left, right, top, bottom;  // both ends belong to it
  DEBULK_INLINE Window over(int side_x, int side_y) const { return {left / side_x, right / side_x, top / side_y, bottom / side_y}; }
};

struct Finder {
  const OpenTables& t;
  std::vector<float>& scratch;
  std::uint32_t self = 0;
  int column = 0, row = 0;
  float p[3] = {};

  DEBULK_INLINE Floats squared(Floats x, Floats y, Floats z) const {
    const Floats dx = all(p[0]) - x, dy = all(p[1]) - y, dz = all(p[2]) - z;
    return dx * dx + dy * dy + dz * dz;
  }

  // The points of a tile that are not open themselves.
  DEBULK_INLINE void visit_tile(int tx, int ty, Nearest& found) const {
    const CloudView& cloud = t.pass->cloud;
    const int first = tx * tile_width, last = std::min(cloud.height, (ty + 1) * tile_height);
    const int columns = std::min(lanes, cloud.width - first);
    for (int j = ty * tile_height; j < last; ++j) {
      const std::uint8_t* from = t.pass->states + static_cast<std::size_t>(j) * static_cast<std::size_t>(cloud.width) + first;
      Floats x = {}, y = {}, z = {};
      Bytes states = {};
      if (columns == lanes) {
        load_points(cloud.point(first, j), x, y, z);
        std::memcpy(&states, from, sizeof states);
      } else {
        states = states + static_cast<signed char>(pixel_open);
        for (int k = 0; k < columns; ++k) {
          const float* q = cloud.point(first + k, j);
          x[k] = q[0], y[k] = q[1], z[k] = q[2];
          states[k] = static_cast<signed char>(from[k]);
        }
      }
      const Ints hidden = __builtin_convertvector(states, Ints) < 0;
      found.add(hidden ? all(infinity) : lower(squared(x, y, z), all(infinity)));  // nothing seen: infinitely far
    }
    found.tighten();
  }

  // The open points of a bin, but itself.
  DEBULK_INLINE void visit_bin(int bx, int by, Nearest& found) const {
    const std::size_t bin = static_cast<std::size_t>(by) * static_cast<std::size_t>(t.bins_x) + static_cast<std::size_t>(bx);
    const int end = static_cast<int>(t.starts[bin + 1]);
    for (int k = static_cast<int>(t.starts[bin]); k < end; k += lanes) {
      Ints index;
      std::memcpy(&index, t.index + k, sizeof index);
      const Ints place = Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15} + k;
      const Ints hidden = (place >= end) | (index == static_cast<int>(self));
      found.add(hidden ? all(infinity) : squared(load(t.x + k), load(t.y + k), load(t.z + k)));
    }
  }

  DEBULK_INLINE Window window(double reach) const {
    const int r = static_cast<int>(std::min(reach, 1e6));
    return {std::max(0, column - r), std::min(t.pass->cloud.width - 1, column + r), std::max(0, row - r),
            std::min(t.pass->cloud.height - 1, row + r)};
  }

  // Squared distances from the point to the tiles' boxes, row by row in the scratch, infinite for an empty tile; a row takes
  // a multiple of 16. Sets the smallest and its place.
  DEBULK_INLINE int bound_tiles(const Window& w, float& least, int& place) const {
    const Tiles& tiles = *t.pass->tiles;
    const int across = (w.right - w.left + lanes) / lanes * lanes;
    const std::size_t wanted = static_cast<std::size_t>(across) * static_cast<std::size_t>(w.bottom - w.top + 1);
    if (scratch.size() < wanted) scratch.resize(wanted);
    float* out = scratch.data();
    Floats smallest = all(infinity);
    const Floats x = all(p[0]), y = all(p[1]), z = all(p[2]), zero = {};
    for (int ty = w.top; ty <= w.bottom; ++ty) {
      const Floats v_low = all(t.v_low[ty]), v_high = all(t.v_high[ty]);
      for (int tx = w.left; tx <= w.right; tx += lanes, out += lanes) {
        const std::size_t at = static_cast<std::size_t>(ty) * static_cast<std::size_t>(tiles.pitch) + static_cast<std::size_t>(tx);
        const Floats near = load(tiles.near.data() + at), far = load(tiles.far.data() + at);
        const Floats u_low = load(t.u_low + tx), u_high = load(t.u_high + tx);
        const Floats dx = higher(higher(lower(u_low * near, u_low * far) - x, x - higher(u_high * near, u_high * far)), zero);
        const Floats dy = higher(higher(lower(v_low * near, v_low * far) - y, y - higher(v_high * near, v_high * far)), zero);
        const Floats dz = higher(higher(near - z, z - far), zero);
        const Ints there = (near <= far) & (Ints{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15} + tx <= w.right);
        const Floats d = there ? (dx * dx + dy * dy + dz * dz) * (1 - 1e-5f) : all(infinity);
        smallest = lower(d, smallest);
        store(out, d);
      }
    }
    least = lowest(smallest);
    place = 0;
    if (least < infinity)
      while (scratch[static_cast<std::size_t>(place)] != least) ++place;
    return across;
  }

  // Everything in the window that can be below the limit.
  DEBULK_INLINE void visit_window(const Window& w, Nearest& found) {
    const Window tiles = w.over(tile_width, tile_height), bins = w.over(bin_side, bin_side);
    float least = 0;
    int place = 0;
    const int across = bound_tiles(tiles, least, place), count = across * (tiles.bottom - tiles.top + 1);
    // The nearest box first: its points give a limit that spares most of the others.
    if (least < infinity) {
      visit_tile(tiles.left + place % across, tiles.top + place / across, found);
      scratch[static_cast<std::size_t>(place)] = infinity;
    }
    for (int by = bins.top; by <= bins.bottom; ++by)
      for (int bx = bins.left; bx <= bins.right; ++bx) visit_bin(bx, by, found);
    found.tighten();
    for (int k = 0; k < count; k += lanes) {
      if (!any(load(scratch.data() + k) <= all(found.limit))) continue;
      for (int i = k; i < k + lanes; ++i)
        if (scratch[static_cast<std::size_t>(i)] <= found.limit && scratch[static_cast<std::size_t>(i)] < infinity)
          visit_tile(tiles.left + i % across, tiles.top + i / across, found);
    }
  }

  // Pixels beyond which no point is nearer than this.
  DEBULK_INLINE double reach(float limit) const {
    return std::ceil(std::sqrt(static_cast<double>(limit)) * (1 + 1e-5) * t.pass->camera.f / static_cast<double>(p[2]) * t.stretch +
                     2 * t.pass->tolerance);
  }

  DEBULK_INLINE float find(std::uint32_t pixel) {
    const CloudView& cloud = t.pass->cloud;
    self = pixel;
    column = static_cast<int>(pixel % static_cast<std::uint32_t>(cloud.width));
    row = static_cast<int>(pixel / static_cast<std::uint32_t>(cloud.width));
    for (int a = 0; a < 3; ++a) p[a] = cloud.point(pixel)[a];
    const double largest = std::max(cloud.width, cloud.height);
    for (double radius = 4;; radius *= 4) {
      Nearest found;
      visit_window(window(radius), found);
      float mean = infinity;
      const float fourth = found.fourth(mean);
      if (!(fourth < infinity) && radius < largest) continue;
      const double needed = fourth < infinity ? reach(fourth) : 0;
      if (needed > radius && radius < largest) {
        Nearest all_of_them(fourth);
        visit_window(window(needed), all_of_them);
        all_of_them.fourth(mean);
      }
      return mean;
    }
  }

  // Asks for a bin's pixels.
  DEBULK_INLINE void fetch(long bin) const {
    const CloudView& cloud = t.pass->cloud;
    const int left = static_cast<int>(bin % t.bins_x) * bin_side, top = static_cast<int>(bin / t.bins_x) * bin_side;
    for (int j = top; j < std::min(cloud.height, top + bin_side); ++j) {
      const char* from = reinterpret_cast<const char*>(cloud.point(left, j));
      for (int k = 0; k < bin_side * 12; k += 64) __builtin_prefetch(from + k);
      __builtin_prefetch(t.pass->states + static_cast<std::size_t>(j) * static_cast<std::size_t>(cloud.width) + left);
    }
  }
};

void run(const OpenTables& tables, long begin, long end, float* distances, std::vector<float>& scratch) {
  Finder finder{tables, scratch};
  for (long bin = begin; bin < end; ++bin) {
    if (bin + 1 < end && tables.starts[bin + 1] < tables.starts[bin + 2]) finder.fetch(bin + 1);
    for (std::uint32_t k = tables.starts[bin]; k < tables.starts[bin + 1]; ++k) distances[k] = finder.find(tables.index[k]);
  }
}
