#include "debulk/surface/gridding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
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
  int middle() const { return (times - 1) / 2; }
  double line(double y) const { return (y - grid.origin.y()) / grid.spacing * times + middle(); }
};

// A row of squares between two rows of corners, and the band of lines in which they are drawn.
struct SquareRow {
  const float *u, *v, *z;  // the upper corners', in lines and columns from the tile's first corner on, and mm
  std::size_t pitch, count;
  float longest_squared, cells_per_mm;
  float first_line, last_line, first_column, last_column;  // of the band, from the tile's first corner on
  float* out;                                              // the highest z so far
  std::size_t wide;
};

#define DEBULK_KERNEL "debulk/surface/squares_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

// Places in the fine grid, counted from a whole line and column, in steps of 2^-16 of its spacing. As long as they are
// below 256 they are floats without any further rounding, so that neighbouring tiles leave no gap.
struct Places {
  double x, y, cells_per_mm;  // of line and column 0
  double column = 0, line = 0;

  explicit Places(const FineGrid& fine)
      : x(fine.grid.origin.x() - fine.middle() * fine.grid.spacing / fine.times),
        y(fine.grid.origin.y() - fine.middle() * fine.grid.spacing / fine.times),
        cells_per_mm(fine.times / fine.grid.spacing) {}
  void count_from(double at_x, double at_y) {
    column = std::floor((at_x - x) * cells_per_mm), line = std::floor((at_y - y) * cells_per_mm);
  }
  float u(double at) const { return step((at - x) * cells_per_mm - column); }
  float v(double at) const { return step((at - y) * cells_per_mm - line); }

 private:
  static float step(double cells) {
    constexpr double round = 1.5 * (1ULL << (52 - 16));
    return static_cast<float>((cells + round) - round);
  }
};

// Takes a row of points apart; what was not seen is NaN. Returns how many points were seen.
DEBULK_WIDE int take_row(const float* __restrict points, int count, const Places& places, float* __restrict u, float* __restrict v,
                         float* __restrict z) {
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  const Places at = places;
  int seen = 0;
  for (int i = 0; i < count; ++i) {
    const float a = points[3 * i], b = points[3 * i + 1], c = points[3 * i + 2], sum = a + b + c;
    const bool is = sum - sum == 0;  // as CloudView::seen
    u[i] = is ? at.u(a) : none, v[i] = is ? at.v(b) : none, z[i] = is ? c : none;
    seen += is ? 1 : 0;
  }
  return seen;
}

// The corners of a tile's triangles: a pixel's point or, if it is missing, the middle between the two points beside it,
// above and below it, or of both pairs, if the points of a pair are close. NaN where there is no corner.
struct Corners {
  static constexpr int side = tile_side + 1;
  static constexpr int count = side * side;
  std::array<float, count> u, v, z;

  // Returns whether there is any point.
  bool read(const CloudView& cloud, int column, int row, Places& places, double longest_squared) {
    const int wide = std::min(static_cast<int>(side), cloud.width - column), high = std::min(static_cast<int>(side), cloud.height - row);
    constexpr float none = std::numeric_limits<float>::quiet_NaN();
    if (!begin(cloud, column, row, wide, high, places)) return false;
    if (wide < side || high < side) u.fill(none), v.fill(none), z.fill(none);
    for (int j = 0; j < high; ++j) {
      const auto at = static_cast<std::size_t>(j * side);
      if (take_row(cloud.point(column, row + j), wide, places, &u[at], &v[at], &z[at]) == wide) continue;
      for (int i = 0; i < wide; ++i)
        if (z[at + static_cast<std::size_t>(i)] != z[at + static_cast<std::size_t>(i)])
          bridge(cloud, column, row, i, j, places, longest_squared);
    }
    return true;
  }

 private:
  // Counts the places from the first point that was seen, at or beside a corner.
  static bool begin(const CloudView& cloud, int column, int row, int wide, int high, Places& places) {
    for (int j = std::max(0, row - 1); j < std::min(cloud.height, row + high + 1); ++j)
      for (int i = std::max(0, column - 1); i < std::min(cloud.width, column + wide + 1); ++i) {
        const auto at = static_cast<std::size_t>(j) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(i);
        if (!cloud.seen(at)) continue;
        places.count_from(cloud.point(at)[0], cloud.point(at)[1]);
        return true;
      }
    return false;
  }
  void bridge(const CloudView& cloud, int column, int row, int i, int j, const Places& places, double longest_squared) {
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
    u[at] = places.u(sum.x() / pairs), v[at] = places.v(sum.y() / pairs), z[at] = static_cast<float>(sum.z() / pairs);
  }
};

// The mean of the square round each of `count` grid points, in pairs of opposite points; `wide` apart lie its `times` lines.
DEBULK_INLINE void mean_squares(const float* __restrict lines, int wide, int times, int count, float* __restrict out) {
  const int middle = times * times / 2, to_end = (times - 1) * (wide + 1);
  for (int i = 0; i < count; ++i) {
    const float* square = lines + static_cast<long>(i) * times;
    double sum = 0, seen = 0;
    for (int k = 0; k < middle; ++k) {
      const int at = k / times * wide + k % times;
      const float one = square[at], opposite = square[to_end - at];
      const bool both = (one != nothing) & (opposite != nothing);
      sum += both ? static_cast<double>(one) + opposite : 0.0;
      seen += both ? 2.0 : 0.0;
    }
    const float centre = square[to_end / 2];
    const bool is = centre != nothing;
    sum += is ? centre : 0.0, seen += is ? 1.0 : 0.0;
    out[i] = seen > 0 ? static_cast<float>(sum / seen) : std::numeric_limits<float>::quiet_NaN();
  }
}
// Three lines in a square are those of the scanner's own pitch: the compiler takes several squares at once if it knows it.
DEBULK_WIDE void mean_row(const float* lines, int wide, int times, int count, float* out) {
  if (times == 1) return mean_squares(lines, wide, 1, count, out);
  if (times == 3) return mean_squares(lines, wide, 3, count, out);
  return mean_squares(lines, wide, times, count, out);
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

  void begin(int from, int to, int wide) {
    first = from, last = to, columns = wide;
    z.assign(static_cast<std::size_t>(last - first) * static_cast<std::size_t>(columns), nothing);
  }
  // Row j of the corners' squares.
  void draw(int j, const Places& from, double longest_squared) {
    const auto top = static_cast<std::size_t>(j) * Corners::side;
    const double cells = from.cells_per_mm;
    const SquareRow row{&corners.u[top],
                        &corners.v[top],
                        &corners.z[top],
                        Corners::side,
                        tile_side,
                        static_cast<float>(longest_squared * cells * cells),
                        static_cast<float>(cells),
                        static_cast<float>(first - from.line),
                        static_cast<float>(last - 1 - from.line),
                        static_cast<float>(-from.column),
                        static_cast<float>(columns - 1 - from.column),
                        z.data(),
                        static_cast<std::size_t>(columns)};
    DEBULK_ON(best_isa(), draw(row));
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
    Places places(fine_);
    if (!band.corners.read(cloud_, tile.column, tile.row, places, longest_squared_)) return;
    for (int j = 0; j < tile_side; ++j) {
      if (stop_.now()) throw Stopped("the height map was stopped");  // pixels in disorder make triangles as large as the map
      band.draw(j, places, longest_squared_);
    }
  }

  void average(const Band& band, int begin, int end) {
    for (int j = begin; j < end; ++j) {
      const float* lines = &band.z[static_cast<std::size_t>(j * fine_.times - band.first) * static_cast<std::size_t>(band.columns)];
      mean_row(lines, band.columns, fine_.times, grid_.nx, &grid_.at(0, j));
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
