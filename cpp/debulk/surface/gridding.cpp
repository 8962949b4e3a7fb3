#include "debulk/surface/gridding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "debulk/cloud/pitch.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/pool.hpp"
#include "debulk/core/simd.hpp"
#include "debulk/core/wide.hpp"
#include "debulk/surface/gridding_unorganised.hpp"

namespace debulk {
namespace {

constexpr int tile_side = 32;     // pixels
constexpr int band_lines = 96;    // lines of the fine grid; a band of grid rows belongs to one thread
constexpr int enough_bands = 16;  // a grid with more of them gets higher ones, which share fewer tiles with their neighbours
constexpr float nothing = -std::numeric_limits<float>::infinity();

// The fine grid: grid point j has the lines j * times ... j * times + times - 1, of which the middle one passes
// through it.
struct FineGrid {
  const Grid<float>& grid;
  int times;
  int columns() const { return grid.nx * times; }
  double line(double y) const { return (y - grid.origin.y()) / grid.spacing * times + (times - 1) / 2; }
};

// Takes a row of points apart; what was not seen is NaN. Returns how many points were seen.
DEBULK_WIDE int take_row(const float* __restrict points, int count, double* __restrict x, double* __restrict y, double* __restrict z) {
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  int seen = 0;
  for (int i = 0; i < count; ++i) {
    const float a = points[3 * i], b = points[3 * i + 1], c = points[3 * i + 2], sum = a + b + c;
    const bool is = sum - sum == 0;  // as CloudView::seen
    x[i] = is ? a : none, y[i] = is ? b : none, z[i] = is ? c : none;
    seen += is ? 1 : 0;
  }
  return seen;
}

// The corners of a tile's triangles: a pixel's point or, if it is missing, the middle between the two points beside it,
// above and below it, or of both pairs, if the points of a pair are close. NaN where there is no corner.
struct Corners {
  static constexpr int side = tile_side + 1;
  static constexpr int count = side * side;
  std::array<double, count> x, y, z, u, v;  // mm, and column and row in the fine grid

  void read(const CloudView& cloud, int column, int row, double longest_squared) {
    const int wide = std::min(static_cast<int>(side), cloud.width - column), high = std::min(static_cast<int>(side), cloud.height - row);
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    if (wide < side || high < side) x.fill(none), y.fill(none), z.fill(none);
    for (int j = 0; j < high; ++j) {
      const auto at = static_cast<std::size_t>(j * side);
      if (take_row(cloud.point(column, row + j), wide, &x[at], &y[at], &z[at]) == wide) continue;
      for (int i = 0; i < wide; ++i)
        if (z[at + static_cast<std::size_t>(i)] != z[at + static_cast<std::size_t>(i)]) bridge(cloud, column, row, i, j, longest_squared);
    }
  }

 private:
  void bridge(const CloudView& cloud, int column, int row, int i, int j, double longest_squared) {
    const auto seen = [&](int a, int b) {
      return a >= 0 && b >= 0 && a < cloud.width && b < cloud.height && cloud.seen(static_cast<std::size_t>(b) * cloud.width + a);
    };
    const auto point = [&](int a, int b) -> Eigen::Vector3d { return Eigen::Map<const Eigen::Vector3f>(cloud.point(a, b)).cast<double>(); };
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int pairs = 0;
    for (const auto& [di, dj] : {std::pair{1, 0}, std::pair{0, 1}}) {
      const int at_column = column + i, at_row = row + j;
      if (!seen(at_column - di, at_row - dj) || !seen(at_column + di, at_row + dj)) continue;
      const Eigen::Vector3d a = point(at_column - di, at_row - dj), b = point(at_column + di, at_row + dj);
      if ((a - b).squaredNorm() > longest_squared) continue;
      sum += (a + b) / 2;
      ++pairs;
    }
    if (!pairs) return;
    const auto at = static_cast<std::size_t>(j * side + i);
    x[at] = sum.x() / pairs, y[at] = sum.y() / pairs, z[at] = sum.z() / pairs;
  }
};

// The compiler takes several of these at once, but not of those of the standard library, which return references.
inline double lower(double a, double b) {
  return b < a ? b : a;
}
inline double higher(double a, double b) {
  return a < b ? b : a;
}

DEBULK_WIDE void place(Corners& corners, double x, double y, double spacing, int times) {
  const int middle = (times - 1) / 2;
  for (std::size_t k = 0; k < Corners::count; ++k) {
    corners.u[k] = (corners.x[k] - x) / spacing * times + middle;
    corners.v[k] = (corners.y[k] - y) / spacing * times + middle;
  }
}

// One triangle of each pair of neighbouring pixels in two rows of pixels. All numbers are those of the triangle alone,
// so that neighbouring triangles leave no gap.
struct Triangles {
  template <class T>
  using Each = std::array<T, tile_side>;
  struct Edge {
    Each<double> u, v, to_u, to_v;  // from the end with the lower v, or with equal v the lower u
  };
  std::array<Edge, 3> edges;
  Each<double> u, v, z, along_u, along_v, lowest, highest;  // a corner, and the plane through it
  Each<int> from, end;                                      // lines of the fine grid
  // On one of these lines: the columns, and the height in the first.
  Each<double> left, right;
  Each<float> height;

  DEBULK_INLINE float height_at(std::size_t k, double column, double line) const {
    const double plane = z[k] + along_u[k] * (column - u[k]) + along_v[k] * (line - v[k]);
    return static_cast<float>(plane < lowest[k] ? lowest[k] : highest[k] < plane ? highest[k] : plane);
  }
};

template <bool upper>
DEBULK_INLINE int prepare(const Corners& corners, std::size_t top, double longest_squared, int first, int last, Triangles& out) {
  constexpr auto side = static_cast<std::size_t>(Corners::side);
  const double *x = &corners.x[top], *y = &corners.y[top], *z = &corners.z[top], *u = &corners.u[top], *v = &corners.v[top];
  const double first_line = first, last_line = last;
  int most = 0;
#pragma GCC ivdep  // the triangles are not the corners
  for (std::size_t k = 0; k < tile_side; ++k) {
    // The square's corners are a, b = k + 1, c below a and d below b. Its diagonal is the one with the smaller step in
    // height or, if a corner is missing, the one through corners that were seen.
    const double za = z[k], zb = z[k + 1], zc = z[side + k], zd = z[side + k + 1];
    const bool along_ad = !((zb == zb) & (zc == zc)) | (std::abs(za - zd) <= std::abs(zb - zc));
    // (a, b, d) and (a, d, c), or (a, b, c) and (b, d, c).
    const auto p = [=](const double* of) { return upper || along_ad ? of[k] : of[k + 1]; };
    const auto q = [=](const double* of) { return upper ? of[k + 1] : of[side + k + 1]; };
    const auto r = [=](const double* of) { return upper && along_ad ? of[side + k + 1] : of[side + k]; };
    const double px = p(x), py = p(y), pz = p(z), pu = p(u), pv = p(v), qx = q(x), qy = q(y), qz = q(z), qu = q(u), qv = q(v);
    const double rx = r(x), ry = r(y), rz = r(z), ru = r(u), rv = r(v);
    const auto near = [=](double dx, double dy, double dz) { return dx * dx + (dy * dy + dz * dz) <= longest_squared; };
    const bool whole = near(px - qx, py - qy, pz - qz) & near(qx - rx, qy - ry, qz - rz) & near(rx - px, ry - py, rz - pz);
    const double qu_p = qu - pu, qv_p = qv - pv, qz_p = qz - pz, ru_p = ru - pu, rv_p = rv - pv, rz_p = rz - pz;
    const double area = qu_p * rv_p - ru_p * qv_p;  // 0: its points belong to its neighbours as well
    const double low = lower(lower(pv, qv), rv), high = higher(higher(pv, qv), rv);
    const double from = higher(first_line, std::ceil(higher(low, first_line - 1)));
    const double to = lower(last_line - 1, std::floor(lower(high, last_line + 1)));
    const bool drawn = whole & (area != 0) & (from <= to);
    const int begin = static_cast<int>(drawn ? from : last_line), end = static_cast<int>(drawn ? to + 1 : first_line);
    out.from[k] = begin, out.end[k] = end;
    most = end - begin > most ? end - begin : most;
    out.u[k] = pu, out.v[k] = pv, out.z[k] = pz;
    out.along_u[k] = (qz_p * rv_p - rz_p * qv_p) / area, out.along_v[k] = (qu_p * rz_p - ru_p * qz_p) / area;
    out.lowest[k] = lower(lower(pz, qz), rz), out.highest[k] = higher(higher(pz, qz), rz);
    const bool pq = (pv < qv) | ((pv == qv) & (pu < qu)), qr = (qv < rv) | ((qv == rv) & (qu < ru));
    const bool rp = (rv < pv) | ((rv == pv) & (ru < pu));
    Triangles::Edge &one = out.edges[0], &two = out.edges[1], &three = out.edges[2];
    one.u[k] = pq ? pu : qu, one.v[k] = pq ? pv : qv, one.to_u[k] = pq ? qu : pu, one.to_v[k] = pq ? qv : pv;
    two.u[k] = qr ? qu : ru, two.v[k] = qr ? qv : rv, two.to_u[k] = qr ? ru : qu, two.to_v[k] = qr ? rv : qv;
    three.u[k] = rp ? ru : pu, three.v[k] = rp ? rv : pv, three.to_u[k] = rp ? pu : ru, three.to_v[k] = rp ? pv : rv;
  }
  return most;
}
// Prepares the upper or the lower triangles between the row of corners that begins at `top` and the next, for the lines
// [first, last). Returns the largest number of lines of one of them.
DEBULK_WIDE int prepare_upper(const Corners& corners, std::size_t top, double longest_squared, int first, int last, Triangles& out) {
  return prepare<true>(corners, top, longest_squared, first, last, out);
}
DEBULK_WIDE int prepare_lower(const Corners& corners, std::size_t top, double longest_squared, int first, int last, Triangles& out) {
  return prepare<false>(corners, top, longest_squared, first, last, out);
}

// Sets the columns of each triangle on its n-th line, and the height in the first. There are no columns on a line that is
// not drawn.
DEBULK_WIDE void cross(Triangles& t, int n, double last_column) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < tile_side; ++k) {
    const double line = t.from[k] + n;
    double left = infinity, right = -infinity;
    for (const Triangles::Edge& e : t.edges) {
      const bool rises = e.to_v[k] > e.v[k], met = (line >= e.v[k]) & (line <= e.to_v[k]);
      const double at = e.u[k] + (e.to_u[k] - e.u[k]) * ((line - e.v[k]) / (e.to_v[k] - e.v[k]));
      const double one = rises ? at : e.u[k], other = rises ? at : e.to_u[k];
      left = met ? lower(left, lower(one, other)) : left, right = met ? higher(right, higher(one, other)) : right;
    }
    const double first = higher(0.0, std::ceil(left)), last = lower(last_column, std::floor(right));
    t.left[k] = first, t.right[k] = line < t.end[k] ? last : -infinity;
    t.height[k] = t.height_at(k, first, line);
  }
}

// Widens the range of each column by one of its points' coordinates; those that are NaN count for nothing.
DEBULK_WIDE void widen(const float* __restrict coordinates, int count, float* __restrict low, float* __restrict high) {
  for (int i = 0; i < count; ++i) {
    const float y = coordinates[3 * i];
    low[i] = y < low[i] ? y : low[i], high[i] = y > high[i] ? y : high[i];
  }
}

// One band of fine lines [first, last), with the highest z so far.
struct Band {
  int first = 0, last = 0, columns = 0;
  std::vector<float> z;
  Corners corners;
  Triangles triangles;

  void begin(int from, int to, int wide) {
    first = from, last = to, columns = wide;
    z.assign(static_cast<std::size_t>(last - first) * static_cast<std::size_t>(columns), nothing);
  }
  void draw(int most) {
    const Triangles& t = triangles;
    for (int n = 0; n < most; ++n) {
      cross(triangles, n, columns - 1.0);
      std::array<std::size_t, tile_side> drawn;
      std::size_t count = 0;
      for (std::size_t k = 0; k < tile_side; ++k) drawn[count] = k, count += t.left[k] <= t.right[k] ? 1 : 0;
      for (std::size_t c = 0; c < count; ++c) {
        const std::size_t k = drawn[c];
        const int line = t.from[k] + n;
        float* out = &z[static_cast<std::size_t>(line - first) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(t.left[k])];
        *out = std::max(*out, t.height[k]);
        for (double u = t.left[k] + 1; u <= t.right[k]; u += 1) ++out, *out = std::max(*out, t.height_at(k, u, line));
      }
    }
  }
};

class OrganisedGridding {
 public:
  OrganisedGridding(const CloudView& cloud, Grid<float>& grid, double longest, int times, int threads, const Stop& stop)
      : cloud_(cloud), grid_(grid), fine_{grid, times}, longest_squared_(longest * longest), threads_(threads), stop_(stop) {}

  void run() {
    find_tiles();
    const int least = std::max(1, band_lines / fine_.times), rows = std::clamp(grid_.ny / enough_bands, least, 3 * least);
    parallel_for(grid_.ny, rows, threads_, stop_, [&](long begin, long end) {
      const std::shared_ptr<Band> band = bands_.borrow();
      band->begin(static_cast<int>(begin) * fine_.times, static_cast<int>(end) * fine_.times, fine_.columns());
      for (const Tile& tile : tiles_)
        if (tile.low <= band->last - 1 && tile.high >= band->first) draw(tile, *band);
      average(*band, static_cast<int>(begin), static_cast<int>(end));
    });
  }

 private:
  struct Tile {
    int column, row;
    double low, high;  // lines of the fine grid that the tile can touch
  };

  // A missing corner lies between its neighbours, of which one may be beside the tile.
  void find_tiles() {
    const int across = (cloud_.width - 2) / tile_side + 1, down = (cloud_.height - 2) / tile_side + 1;
    tiles_.resize(static_cast<std::size_t>(across) * down);
    parallel_for(down, 1, threads_, stop_, [&](long begin, long) {
      const int row = static_cast<int>(begin) * tile_side, first = std::max(0, row - 1), end = std::min(cloud_.height, row + tile_side + 2);
      std::vector<float> lows(static_cast<std::size_t>(cloud_.width), std::numeric_limits<float>::infinity());
      std::vector<float> highs(lows.size(), -std::numeric_limits<float>::infinity());
      for (int j = first; j < end; ++j) widen(cloud_.point(0, j) + 1, cloud_.width, lows.data(), highs.data());
      for (int t = 0; t < across; ++t) {
        const int column = t * tile_side, from = std::max(0, column - 1), to = std::min(cloud_.width, column + tile_side + 2);
        const float low = *std::min_element(&lows[static_cast<std::size_t>(from)], lows.data() + to);
        const float high = *std::max_element(&highs[static_cast<std::size_t>(from)], highs.data() + to);
        tiles_[static_cast<std::size_t>(begin) * across + t] = {column, row, fine_.line(low), fine_.line(high)};
      }
    });
  }

  void draw(const Tile& tile, Band& band) const {
    band.corners.read(cloud_, tile.column, tile.row, longest_squared_);
    place(band.corners, grid_.origin.x(), grid_.origin.y(), grid_.spacing, fine_.times);
    for (int j = 0; j < tile_side; ++j) {
      if (stop_.now()) throw Stopped("the height map was stopped");  // pixels in disorder make triangles as large as the map
      const auto top = static_cast<std::size_t>(j) * Corners::side;
      for (const auto& prepared : {prepare_upper, prepare_lower})
        band.draw(prepared(band.corners, top, longest_squared_, band.first, band.last, band.triangles));
    }
  }

  void average(const Band& band, int begin, int end) {
    const int times = fine_.times, count = times * times;
    std::vector<std::size_t> at(static_cast<std::size_t>(count));  // of the k-th point of the square, row by row
    for (std::size_t k = 0; k < at.size(); ++k) at[k] = k / times * static_cast<std::size_t>(band.columns) + k % times;
    for (int j = begin; j < end; ++j)
      for (int i = 0; i < grid_.nx; ++i) {
        const float* square =
            &band.z[static_cast<std::size_t>(j * times - band.first) * band.columns + static_cast<std::size_t>(i) * times];
        const auto fine = [&](int k) { return square[at[static_cast<std::size_t>(k)]]; };
        double sum = 0;
        int seen = 0;
        for (int k = 0; 2 * k < count - 1; ++k) {
          const float one = fine(k), opposite = fine(count - 1 - k);
          if (one == nothing || opposite == nothing) continue;
          sum += static_cast<double>(one) + opposite;
          seen += 2;
        }
        const float centre = fine(count / 2);
        if (centre != nothing) sum += centre, ++seen;
        grid_.at(i, j) = seen ? static_cast<float>(sum / seen) : std::numeric_limits<float>::quiet_NaN();
      }
  }

  CloudView cloud_;
  Grid<float>& grid_;
  FineGrid fine_;
  double longest_squared_;
  int threads_;
  Stop stop_;
  std::vector<Tile> tiles_;
  Pool<Band> bands_;  // fresh pages for each would take a while
};

}  // namespace

void GriddingOptions::check() const {
  require(std::isfinite(jump_ratio) && jump_ratio >= 3, "jump_ratio", "3 pitches or more", jump_ratio);
}

Grid<float> covering_grid(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double spacing) {
  require(std::isfinite(spacing) && spacing > 0, "spacing_mm", "a positive length in mm", spacing);
  const Eigen::Vector2d first = (low / spacing).array().ceil(), last = (high / spacing).array().floor();
  const Eigen::Vector2d count = last - first + Eigen::Vector2d::Ones();
  require(count.minCoeff() >= 1, "points", "a cloud that covers at least one grid point (do scan and reference overlap?)",
          "a common box of " + std::to_string(high.x() - low.x()) + " by " + std::to_string(high.y() - low.y()) + " mm");
  require(count.prod() <= 2e8, "spacing_mm", "a grid of at most 2e8 points (is the unit mm? are there stray points?)",
          std::to_string(count.x()) + " by " + std::to_string(count.y()) + " points of " + std::to_string(spacing) + " mm");
  return Grid<float>(static_cast<int>(count.x()), static_cast<int>(count.y()), first * spacing, spacing,
                     std::numeric_limits<float>::quiet_NaN());
}

double grid_heights(const CloudView& cloud, Grid<float>& grid, const GriddingOptions& options, int threads, const Stop& stop) {
  options.check();
  require(std::isfinite(grid.spacing) && grid.spacing > 0, "spacing_mm", "a positive length in mm", grid.spacing);
  require(grid.origin.allFinite(), "origin_mm", "two finite coordinates in mm", grid.origin.transpose());
  std::fill(grid.values.begin(), grid.values.end(), std::numeric_limits<float>::quiet_NaN());
  const double pitch = options.pitch > 0 ? options.pitch : median_pitch(cloud, threads, stop);
  if (!(pitch > 0) || grid.size() == 0) return 0;
  if (!cloud.organised()) return grid_unorganised(cloud, grid, pitch, threads, stop);
  int times = 1;
  if (grid.spacing > 1.5 * pitch) times = 2 * static_cast<int>(std::ceil((grid.spacing / pitch - 1) / 2)) + 1;
  OrganisedGridding(cloud, grid, options.jump_ratio * pitch, std::min(times, 99), threads, stop).run();
  return grid.spacing * grid.spacing / 6;  // interpolated between points
}

}  // namespace debulk
