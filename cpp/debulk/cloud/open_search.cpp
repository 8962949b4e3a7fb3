#include "debulk/cloud/open_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/parallel.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

using namespace wide;

constexpr int bin_side = 32;  // pixels
constexpr float infinity = std::numeric_limits<float>::infinity();

// The four smallest squared distances so far.
struct Nearest {
  float squares[4] = {infinity, infinity, infinity, infinity};
  float limit = infinity;  // only what is below is of interest
  DEBULK_INLINE void add(float d) {
    int k = 3;
    for (; k > 0 && squares[k - 1] > d; --k) squares[k] = squares[k - 1];
    squares[k] = d;
    limit = squares[3] < limit ? squares[3] : limit;
  }
  DEBULK_INLINE void add(Floats d) {
    if (!any(d < all(limit))) return;
    alignas(64) float values[lanes];
    store(values, d);
    for (const float value : values)
      if (value < limit) add(value);
  }
};

}  // namespace

struct OpenSearch::Finder {
  const OpenSearch& all_;
  const WindowPass& pass;
  std::vector<float>& scratch;
  std::uint32_t self = 0;
  int column = 0, row = 0;
  float p[3] = {};

  DEBULK_INLINE Floats squared(Floats x, Floats y, Floats z) const {
    const Floats dx = all(p[0]) - x, dy = all(p[1]) - y, dz = all(p[2]) - z;
    return dx * dx + dy * dy + dz * dz;
  }

  DEBULK_INLINE void visit_tile(int tx, int ty, Nearest& found) const {
    const CloudView& cloud = pass.cloud;
    const int first = tx * tile_width, last = std::min(cloud.height, (ty + 1) * tile_height);
    for (int j = ty * tile_height; j < last; ++j) {
      alignas(64) float x[lanes], y[lanes], z[lanes], hidden[lanes];
      const std::uint8_t* states = pass.states + static_cast<std::size_t>(j) * static_cast<std::size_t>(cloud.width) + first;
      const int columns = std::min(lanes, cloud.width - first);
      if (columns == lanes) {
        load_points(cloud.point(first, j), x, y, z);
        for (int k = 0; k < lanes; ++k) hidden[k] = states[k] == pixel_open ? infinity : 0.0f;
      } else {
        for (int k = 0; k < lanes; ++k) {
          const float* q = cloud.point(first + std::min(k, columns - 1), j);
          x[k] = q[0], y[k] = q[1], z[k] = q[2];
          hidden[k] = k >= columns || states[k] == pixel_open ? infinity : 0.0f;
        }
      }
      found.add(squared(load(x), load(y), load(z)) + load(hidden));
    }
  }

  DEBULK_INLINE void visit_bin(int bx, int by, Nearest& found) const {
    const std::size_t bin = static_cast<std::size_t>(by) * static_cast<std::size_t>(all_.bins_x_) + static_cast<std::size_t>(bx);
    const std::uint32_t end = all_.starts_[bin + 1];
    for (std::uint32_t k = all_.starts_[bin]; k < end; k += lanes) {
      alignas(64) float hidden[lanes];
      for (std::uint32_t i = 0; i < lanes; ++i) hidden[i] = k + i >= end || all_.index_[k + i] == self ? infinity : 0.0f;
      found.add(squared(load(&all_.x_[k]), load(&all_.y_[k]), load(&all_.z_[k])) + load(hidden));
    }
  }

  struct Window {
    int left, right, top, bottom;  // both ends belong to it
    DEBULK_INLINE Window over(int side_x, int side_y) const { return {left / side_x, right / side_x, top / side_y, bottom / side_y}; }
  };
  DEBULK_INLINE Window window(double reach) const {
    const int r = static_cast<int>(std::min(reach, 1e6));
    return {std::max(0, column - r), std::min(pass.cloud.width - 1, column + r), std::max(0, row - r),
            std::min(pass.cloud.height - 1, row + r)};
  }

  // Squared distances from the point to the tiles' boxes, row by row in the scratch; NaN for an empty tile.
  DEBULK_INLINE int bound_tiles(const Window& w) const {
    const Tiles& tiles = *pass.tiles;
    const int across = (w.right - w.left + lanes) / lanes * lanes;
    const std::size_t wanted = static_cast<std::size_t>(across) * static_cast<std::size_t>(w.bottom - w.top + 1);
    if (scratch.size() < wanted) scratch.resize(wanted);
    const double slack = pass.tolerance / pass.camera.f;
    float* out = scratch.data();
    for (int ty = w.top; ty <= w.bottom; ++ty) {
      const auto v_low = static_cast<float>(pass.camera.v(ty * tile_height) - slack);
      const auto v_high = static_cast<float>(pass.camera.v((ty + 1) * tile_height - 1) + slack);
      for (int tx = w.left; tx <= w.right; tx += lanes, out += lanes) {
        const std::size_t at = static_cast<std::size_t>(ty) * static_cast<std::size_t>(tiles.pitch) + static_cast<std::size_t>(tx);
        const Floats near = load(&tiles.near[at]), far = load(&tiles.far[at]), zero = {};
        const Floats u_low = load(&all_.u_low_[static_cast<std::size_t>(tx)]), u_high = load(&all_.u_high_[static_cast<std::size_t>(tx)]);
        const Floats x = all(p[0]), y = all(p[1]), z = all(p[2]);
        const Floats dx = higher(higher(lower(u_low * near, u_low * far) - x, x - higher(u_high * near, u_high * far)), zero);
        const Floats dy = higher(higher(lower(v_low * near, v_low * far) - y, y - higher(v_high * near, v_high * far)), zero);
        const Floats dz = higher(higher(near - z, z - far), zero);
        Floats d = (dx * dx + dy * dy + dz * dz) * (1 - 1e-5f);
        d = near <= far ? d : all(infinity);
        store(out, d);
      }
    }
    return across;
  }

  DEBULK_INLINE void visit_bins(const Window& w, Nearest& found) const {
    const Window bins = w.over(bin_side, bin_side);
    for (int by = bins.top; by <= bins.bottom; ++by)
      for (int bx = bins.left; bx <= bins.right; ++bx) visit_bin(bx, by, found);
  }

  // Everything in the window that can be below the limit.
  DEBULK_INLINE void visit_window(const Window& w, Nearest& found) {
    const Window tiles = w.over(tile_width, tile_height);
    const int across = bound_tiles(tiles);
    // The nearest box first: its points give a limit that spares most of the others.
    const int count = across * (tiles.bottom - tiles.top + 1);
    int best = 0;
    for (int k = 0; k < count; ++k)
      if (scratch[static_cast<std::size_t>(k)] < scratch[static_cast<std::size_t>(best)]) best = k;
    if (!(scratch[static_cast<std::size_t>(best)] < infinity)) return visit_bins(w, found);
    visit_tile(tiles.left + best % across, tiles.top + best / across, found);
    scratch[static_cast<std::size_t>(best)] = infinity;
    visit_bins(w, found);
    for (int k = 0; k < count; k += lanes) {
      const Floats d = load(&scratch[static_cast<std::size_t>(k)]);
      if (!any(d < all(found.limit))) continue;
      for (int i = k; i < k + lanes; ++i)
        if (scratch[static_cast<std::size_t>(i)] < found.limit) visit_tile(tiles.left + i % across, tiles.top + i / across, found);
    }
  }

  // Points farther than so many pixels to any side are not nearer than this.
  DEBULK_INLINE double reach(float squared_limit) const {
    return std::sqrt(static_cast<double>(squared_limit)) * (1 + 1e-5) * pass.camera.f / p[2] * all_.stretch_ + 2 * pass.tolerance;
  }

  DEBULK_INLINE float find(std::uint32_t pixel) {
    self = pixel;
    column = static_cast<int>(pixel % static_cast<std::uint32_t>(pass.cloud.width));
    row = static_cast<int>(pixel / static_cast<std::uint32_t>(pass.cloud.width));
    for (int a = 0; a < 3; ++a) p[a] = pass.cloud.point(pixel)[a];
    const double largest = std::max(pass.cloud.width, pass.cloud.height);
    for (double radius = 4;; radius *= 4) {
      Nearest found;
      visit_window(window(radius), found);
      const double needed = found.limit < infinity ? std::ceil(reach(found.limit)) : largest;
      if (needed > radius && radius < largest) {
        if (!(found.limit < infinity)) continue;
        const float limit = std::nextafter(found.limit, infinity);  // it may be found again
        found = Nearest();
        found.limit = limit;
        visit_window(window(needed), found);
      }
      double sum = 0;
      for (const float square : found.squares) sum += std::sqrt(static_cast<double>(square));
      return static_cast<float>(sum / 4);
    }
  }
};

DEBULK_WIDE void search_open(const OpenSearch& search, std::size_t begin, std::size_t end, float* distances, std::vector<float>& scratch) {
  OpenSearch::Finder finder{search, *search.pass_, scratch};
  for (std::size_t k = begin; k < end; ++k) distances[k] = finder.find(search.order_[k]);
}

void OpenSearch::prepare(const WindowPass& pass, const std::vector<WindowBand>& bands) {
  pass_ = &pass;
  const CloudView& cloud = pass.cloud;
  const double slack = pass.tolerance / pass.camera.f;
  double widest = 0;
  for (const double at : {pass.camera.u(0), pass.camera.u(cloud.width - 1.0), pass.camera.v(0), pass.camera.v(cloud.height - 1.0)})
    widest = std::max(widest, std::abs(at) + slack);
  stretch_ = std::sqrt(1 + widest * widest);
  u_low_.resize(static_cast<std::size_t>(pass.tiles->pitch)), u_high_.resize(u_low_.size());
  for (std::size_t t = 0; t < u_low_.size(); ++t) {
    u_low_[t] = static_cast<float>(pass.camera.u(static_cast<double>(t) * tile_width) - slack);
    u_high_[t] = static_cast<float>(pass.camera.u(static_cast<double>(t + 1) * tile_width - 1) + slack);
  }

  bins_x_ = (cloud.width + bin_side - 1) / bin_side, bins_y_ = (cloud.height + bin_side - 1) / bin_side;
  order_.clear();
  for (const WindowBand& band : bands) order_.insert(order_.end(), band.open.begin(), band.open.end());
  const auto bin_of = [&](std::uint32_t pixel) {
    const std::uint32_t width = static_cast<std::uint32_t>(cloud.width);
    return static_cast<std::size_t>(pixel / width / bin_side) * static_cast<std::size_t>(bins_x_) + pixel % width / bin_side;
  };
  starts_.assign(static_cast<std::size_t>(bins_x_) * static_cast<std::size_t>(bins_y_) + 2, 0);
  for (const std::uint32_t pixel : order_) ++starts_[bin_of(pixel) + 2];
  for (std::size_t b = 2; b < starts_.size(); ++b) starts_[b] += starts_[b - 1];
  index_.resize(order_.size());
  for (std::vector<float>* v : {&x_, &y_, &z_}) v->assign(order_.size() + lanes, 0.0f);
  for (const std::uint32_t pixel : order_) {
    const std::uint32_t at = starts_[bin_of(pixel) + 1]++;
    index_[at] = pixel;
    const float* p = cloud.point(pixel);
    x_[at] = p[0], y_[at] = p[1], z_[at] = p[2];
  }
}

void OpenSearch::run(std::vector<float>& distances, int threads) {
  distances.resize(order_.size());
  parallel_for(static_cast<long>(order_.size()), 2048, threads, [&](long begin, long end) {
    std::vector<float> scratch(256);
    search_open(*this, static_cast<std::size_t>(begin), static_cast<std::size_t>(end), distances.data(), scratch);
  });
}

}  // namespace debulk
