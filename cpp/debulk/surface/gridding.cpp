#include "debulk/surface/gridding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "debulk/cloud/pitch.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/surface/gridding_unorganised.hpp"

namespace debulk {
namespace {

constexpr int tile_side = 32;   // pixels
constexpr int band_lines = 96;  // lines of the fine grid; a band of grid rows belongs to one thread
constexpr float nothing = -std::numeric_limits<float>::infinity();

struct Vertex {
  double u = 0, v = 0;  // column and row in the fine grid
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero();
  bool seen = false;
};

// The fine grid: grid point j has the lines j * times ... j * times + times - 1, of which the middle one passes
// through it.
struct FineGrid {
  const Grid<float>& grid;
  int times;
  int columns() const { return grid.nx * times; }
  Vertex vertex(const Eigen::Vector3d& xyz) const {
    const Eigen::Vector2d at = grid.locate(xyz.head<2>()) * times + Eigen::Vector2d::Constant((times - 1) / 2);
    return {at.x(), at.y(), xyz, true};
  }
};

// A pixel's point or, if it is missing, the middle between the two points beside it, above and below it, or of both
// pairs, if the points of a pair are close.
Vertex vertex(const CloudView& cloud, int column, int row, double longest_squared, const FineGrid& fine) {
  const auto seen = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < cloud.width && j < cloud.height && cloud.seen(static_cast<std::size_t>(j) * cloud.width + i);
  };
  const auto point = [&](int i, int j) -> Eigen::Vector3d { return Eigen::Map<const Eigen::Vector3f>(cloud.point(i, j)).cast<double>(); };
  if (seen(column, row)) return fine.vertex(point(column, row));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int pairs = 0;
  for (const auto& [di, dj] : {std::pair{1, 0}, std::pair{0, 1}}) {
    if (!seen(column - di, row - dj) || !seen(column + di, row + dj)) continue;
    const Eigen::Vector3d a = point(column - di, row - dj), b = point(column + di, row + dj);
    if ((a - b).squaredNorm() > longest_squared) continue;
    sum += (a + b) / 2;
    ++pairs;
  }
  return pairs ? fine.vertex(sum / pairs) : Vertex();
}

// One band of fine lines [first, last), with the highest z so far.
struct Band {
  int first, last, columns;
  std::vector<float> z;

  void draw(const Vertex& a, const Vertex& b, const Vertex& c) {
    const double low = std::min({a.v, b.v, c.v}), high = std::max({a.v, b.v, c.v});
    const int from = std::max(first, static_cast<int>(std::ceil(std::max(low, first - 1.0))));
    const int to = std::min(last - 1, static_cast<int>(std::floor(std::min(high, last + 1.0))));
    if (from > to) return;
    const double ub = b.u - a.u, vb = b.v - a.v, zb = b.xyz.z() - a.xyz.z();
    const double uc = c.u - a.u, vc = c.v - a.v, zc = c.xyz.z() - a.xyz.z();
    const double area = ub * vc - uc * vb;
    if (area == 0) return;  // its points belong to its neighbours as well
    const double zu = (zb * vc - zc * vb) / area, zv = (ub * zc - uc * zb) / area;
    const double lowest = std::min({a.xyz.z(), b.xyz.z(), c.xyz.z()}), highest = std::max({a.xyz.z(), b.xyz.z(), c.xyz.z()});
    for (int line = from; line <= to; ++line) {
      double left = std::numeric_limits<double>::infinity(), right = -left;
      // p below q. Neighbouring triangles compute the same numbers, so there is no gap.
      const auto cross = [&](const Vertex& p, const Vertex& q) {
        if (line < p.v || line > q.v) return;
        const double u = q.v > p.v ? p.u + (q.u - p.u) * ((line - p.v) / (q.v - p.v)) : p.u;
        left = std::min({left, u, q.v > p.v ? u : q.u});
        right = std::max({right, u, q.v > p.v ? u : q.u});
      };
      for (const auto& [p, q] : {std::pair{&a, &b}, std::pair{&b, &c}, std::pair{&c, &a}})
        if (p->v < q->v || (p->v == q->v && p->u < q->u))
          cross(*p, *q);
        else
          cross(*q, *p);
      const double begin = std::max(0.0, std::ceil(left)), end = std::min(columns - 1.0, std::floor(right));
      float* row = &z[static_cast<std::size_t>(line - first) * columns];
      for (double u = begin; u <= end; u += 1) {
        const double height = std::clamp(a.xyz.z() + zu * (u - a.u) + zv * (line - a.v), lowest, highest);
        float& out = row[static_cast<int>(u)];
        out = std::max(out, static_cast<float>(height));
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
    const int rows = std::max(1, band_lines / fine_.times);
    parallel_for(grid_.ny, rows, threads_, stop_, [&](long begin, long end) {
      Band band{static_cast<int>(begin) * fine_.times, static_cast<int>(end) * fine_.times, fine_.columns(), {}};
      band.z.assign(static_cast<std::size_t>(band.last - band.first) * band.columns, nothing);
      for (const Tile& tile : tiles_)
        if (tile.low <= band.last - 1 && tile.high >= band.first) draw(tile, band);
      average(band, static_cast<int>(begin), static_cast<int>(end));
    });
  }

 private:
  struct Tile {
    int column, row;
    double low, high;  // lines of the fine grid that the tile can touch
  };

  template <class Visit>
  void for_vertices(int column, int row, const Visit& visit) const {
    for (int j = 0; j <= std::min(tile_side, cloud_.height - 1 - row); ++j)
      for (int i = 0; i <= std::min(tile_side, cloud_.width - 1 - column); ++i)
        visit(i, j, vertex(cloud_, column + i, row + j, longest_squared_, fine_));
  }

  void find_tiles() {
    const int across = (cloud_.width - 2) / tile_side + 1, down = (cloud_.height - 2) / tile_side + 1;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    tiles_.assign(static_cast<std::size_t>(across) * down, Tile{0, 0, infinity, -infinity});
    parallel_for(down, 1, threads_, stop_, [&](long begin, long) {
      for (int t = 0; t < across; ++t) {
        Tile& tile = tiles_[static_cast<std::size_t>(begin) * across + t];
        tile.column = t * tile_side;
        tile.row = static_cast<int>(begin) * tile_side;
        for_vertices(tile.column, tile.row, [&](int, int, const Vertex& p) {
          if (!p.seen) return;
          tile.low = std::min(tile.low, p.v);
          tile.high = std::max(tile.high, p.v);
        });
      }
    });
  }

  void draw(const Tile& tile, Band& band) const {
    std::array<Vertex, (tile_side + 1) * (tile_side + 1)> vertices;
    const auto at = [&](int i, int j) -> Vertex& { return vertices[static_cast<std::size_t>(j * (tile_side + 1) + i)]; };
    for_vertices(tile.column, tile.row, [&](int i, int j, const Vertex& p) { at(i, j) = p; });
    const int across = std::min(tile_side, cloud_.width - 1 - tile.column), down = std::min(tile_side, cloud_.height - 1 - tile.row);
    for (int j = 0; j < down; ++j) {
      if (stop_.now()) throw Stopped("the height map was stopped");  // pixels in disorder make triangles as large as the map
      for (int i = 0; i < across; ++i) {
        const Vertex &a = at(i, j), &b = at(i + 1, j), &c = at(i, j + 1), &d = at(i + 1, j + 1);
        const auto triangle = [&](const Vertex& p, const Vertex& q, const Vertex& r) {
          if (!p.seen || !q.seen || !r.seen) return;
          if ((p.xyz - q.xyz).squaredNorm() <= longest_squared_ && (q.xyz - r.xyz).squaredNorm() <= longest_squared_ &&
              (r.xyz - p.xyz).squaredNorm() <= longest_squared_)
            band.draw(p, q, r);
        };
        // The diagonal with the smaller step in height or, if a corner is missing, the one through corners that were
        // seen.
        const bool along_ad = (!b.seen || !c.seen)   ? true
                              : (!a.seen || !d.seen) ? false
                                                     : std::abs(a.xyz.z() - d.xyz.z()) <= std::abs(b.xyz.z() - c.xyz.z());
        if (along_ad) {
          triangle(a, b, d);
          triangle(a, d, c);
        } else {
          triangle(a, b, c);
          triangle(b, d, c);
        }
      }
    }
  }

  void average(const Band& band, int begin, int end) {
    const int times = fine_.times, middle = (times - 1) / 2;
    for (int j = begin; j < end; ++j)
      for (int i = 0; i < grid_.nx; ++i) {
        const auto fine = [&](int k) {  // k-th point of the square, row by row
          return band.z[static_cast<std::size_t>(j * times + k / times - band.first) * band.columns + i * times + k % times];
        };
        double sum = 0;
        int count = 0;
        for (int k = 0; 2 * k < times * times - 1; ++k) {
          const float one = fine(k), opposite = fine(times * times - 1 - k);
          if (one == nothing || opposite == nothing) continue;
          sum += static_cast<double>(one) + opposite;
          count += 2;
        }
        const float centre = fine(middle * times + middle);
        if (centre != nothing) sum += centre, ++count;
        grid_.at(i, j) = count ? static_cast<float>(sum / count) : std::numeric_limits<float>::quiet_NaN();
      }
  }

  CloudView cloud_;
  Grid<float>& grid_;
  FineGrid fine_;
  double longest_squared_;
  int threads_;
  Stop stop_;
  std::vector<Tile> tiles_;
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

void grid_heights(const CloudView& cloud, Grid<float>& grid, const GriddingOptions& options, int threads, const Stop& stop) {
  options.check();
  require(std::isfinite(grid.spacing) && grid.spacing > 0, "spacing_mm", "a positive length in mm", grid.spacing);
  require(grid.origin.allFinite(), "origin_mm", "two finite coordinates in mm", grid.origin.transpose());
  std::fill(grid.values.begin(), grid.values.end(), std::numeric_limits<float>::quiet_NaN());
  const double pitch = median_pitch(cloud, threads, stop);
  if (!(pitch > 0) || grid.size() == 0) return;
  if (!cloud.organised()) return grid_unorganised(cloud, grid, pitch, threads, stop);
  int times = 1;
  if (grid.spacing > 1.5 * pitch) times = 2 * static_cast<int>(std::ceil((grid.spacing / pitch - 1) / 2)) + 1;
  OrganisedGridding(cloud, grid, options.jump_ratio * pitch, std::min(times, 99), threads, stop).run();
}

}  // namespace debulk
