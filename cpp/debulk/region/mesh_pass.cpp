#include "debulk/region/mesh_pass.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr double row_mm = 2.5;           // largest distance between rows of the mesh
constexpr int widest = 256, least = 16;  // largest and smallest column step, pixels
constexpr int ahead = 8;                 // a column's pixels are far apart in memory: each is fetched this many rows early
constexpr int around = 2;                // the pixels round a high one are examined up to this distance each way
constexpr int high_share = 8, of = 25;

struct MeshRow {
  const float* xyz;
  const std::uint8_t* masked;
  int width;
  const float *u, *depth, *depth_below, *gain, *gain_below;
  int base_step, base_nx;
  float t, v, slack, reach, high, clamp;
  float *cells, *tile_sum, *tile_count;
};
struct MeshBuffers {
  std::vector<float> x, y, z, base, gain;
};
struct MeshRowSums {
  std::vector<int> high;
  long seen = 0, strays = 0;
  float across = 0;  // mm, along x
};

#define DEBULK_KERNEL "debulk/region/mesh_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

void read_row(Isa isa, const MeshRow& row, MeshBuffers& buffers, MeshRowSums& out) {
  return DEBULK_ON(isa, run(row, buffers, out));
}

// Heights of single pixels.
struct Pixels {
  const CloudView& scan;
  const std::uint8_t* masked;
  const RayBase& base;

  const float* seen(int column, int row) const {
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(scan.width) + static_cast<std::size_t>(column);
    return !(masked && masked[at]) && scan.seen(at) ? scan.point(at) : nullptr;
  }
  float height(int column, int row, const float* p) const {
    const int i = column / base.step, j = row / base.step;
    const float s = static_cast<float>(column - i * base.step) / static_cast<float>(base.step);
    const float t = static_cast<float>(row - j * base.step) / static_cast<float>(base.step);
    const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(base.nx) + static_cast<std::size_t>(i);
    const std::size_t below = at + static_cast<std::size_t>(base.nx);
    const auto between = [&](const std::vector<float>& v) {
      const float left = v[at] + t * (v[below] - v[at]), right = v[at + 1] + t * (v[below + 1] - v[at + 1]);
      return left + s * (right - left);
    };
    return (p[2] - between(base.depth)) * between(base.gain);
  }
  // Whether enough neighbours of a high pixel are high too, so that it is not a single flying pixel.
  bool stands(int column, int row, float high) const {
    int there = 0, above = 0;
    for (int j = std::max(0, row - around); j <= std::min(scan.height - 1, row + around); ++j)
      for (int i = std::max(0, column - around); i <= std::min(scan.width - 1, column + around); ++i)
        if (const float* p = seen(i, j)) {
          ++there;
          above += height(i, j, p) >= high;
        }
    return above >= 3 && of * above >= high_share * there;
  }
};

bool matters(const float* p, const View& view, const Grid<std::uint8_t>* wanted) {
  if (!wanted) return true;
  const Eigen::Vector3d at = view.rotation() * Eigen::Vector3d(p[0], p[1], p[2]) + view.centre();
  const Eigen::Vector2d cell = wanted->locate(at.head<2>());
  const int i = static_cast<int>(std::lround(cell.x())), j = static_cast<int>(std::lround(cell.y()));
  return wanted->contains(i, j) && wanted->at(i, j) != 0;
}

}  // namespace

Mesh choose_mesh(const RayBase& base, const View& view, double area_mm2, const Grid<std::uint8_t>* wanted) {
  Mesh mesh;
  const auto at = [&](int i, int j) -> Eigen::Vector2d {
    const double depth = base.depth[static_cast<std::size_t>(j) * static_cast<std::size_t>(base.nx) + static_cast<std::size_t>(i)];
    const Eigen::Vector3d ray(view.camera.u(static_cast<double>(i) * base.step), view.camera.v(static_cast<double>(j) * base.step), 1);
    return (depth * (view.rotation() * ray) + view.centre()).head<2>();
  };
  const auto counts = [&](const Eigen::Vector2d& xy) {
    if (!wanted) return true;
    const Eigen::Vector2d cell = wanted->locate(xy);
    const int i = static_cast<int>(std::lround(cell.x())), j = static_cast<int>(std::lround(cell.y()));
    return wanted->contains(i, j) && wanted->at(i, j) != 0;
  };
  std::vector<double> sides, areas;
  for (int j = 0; j + 1 < base.ny; ++j)
    for (int i = 0; i + 1 < base.nx; ++i) {
      const Eigen::Vector2d here = at(i, j), right = at(i + 1, j), below = at(i, j + 1);
      if (!here.allFinite() || !right.allFinite() || !below.allFinite()) continue;
      if (!counts(here) || !counts(right) || !counts(below)) continue;
      const Eigen::Vector2d along = (right - here) / base.step, down = (below - here) / base.step;
      sides.push_back(std::max(along.norm(), down.norm()));
      areas.push_back(std::abs(along.x() * down.y() - along.y() * down.x()));
    }
  if (sides.empty()) return mesh;
  const auto rank = static_cast<long>(wanted ? sides.size() - 1 : (sides.size() - 1) * 98 / 100);
  std::nth_element(sides.begin(), sides.begin() + rank, sides.end());
  std::nth_element(areas.begin(), areas.begin() + rank, areas.end());
  mesh.pixel_mm = sides[static_cast<std::size_t>(rank)], mesh.pixel_mm2 = areas[static_cast<std::size_t>(rank)];
  if (!(mesh.pixel_mm > 0)) return mesh;
  for (int rows = 16; rows >= 1; rows /= 2) {
    if (rows > 1 && rows * mesh.pixel_mm > row_mm) continue;
    for (int columns = widest; columns >= least; columns /= 2)
      if (2 * rows * columns * mesh.pixel_mm2 <= area_mm2) {
        mesh.row_step = rows, mesh.column_step = columns;
        return mesh;
      }
  }
  return mesh;
}

void MeshPass::run(const CloudView& scan, const std::uint8_t* masked, const View& view, const Mesh& mesh, const RayBase& base,
                   const MeshOptions& options, const Grid<std::uint8_t>* wanted, const std::vector<TileSpan>& spans, int threads,
                   const Stop& stop) {
  const int width = scan.width, height = scan.height, step = mesh.row_step;
  tiles_x_ = (width + tile_side - 1) / tile_side, tiles_y_ = (height + tile_side - 1) / tile_side;
  cells_x_ = (width + cell_columns - 1) / cell_columns, cells_y_ = (height + step - 1) / step;
  cell_pitch_ = tiles_x_ * (tile_side / cell_columns);
  cell_height_.assign(static_cast<std::size_t>(cell_pitch_) * static_cast<std::size_t>(cells_y_), nan);
  const std::size_t tiles = static_cast<std::size_t>(tiles_x_) * static_cast<std::size_t>(tiles_y_);
  tile_height_.assign(tiles, nan);
  tile_high_.assign(tiles, 0);
  bands_.assign(static_cast<std::size_t>(tiles_y_), Band());
  u_.resize(static_cast<std::size_t>(tiles_x_) * tile_side);
  for (std::size_t k = 0; k < u_.size(); ++k) u_[k] = static_cast<float>(view.camera.u(static_cast<double>(k)));
  const float high = static_cast<float>(options.high_mm);
  const Isa isa = best_isa();
  const Pixels pixels{scan, masked, base};

  constexpr long chunk = 4;  // rows of tiles
  parallel_for(tiles_y_, chunk, threads, [&](long begin, long end) {
    if (stop.now()) throw Stopped("the coarse pass was stopped");
    MeshBuffers buffers;
    const std::size_t room = static_cast<std::size_t>(tiles_x_) * tile_side + 32;
    for (std::vector<float>* v : {&buffers.x, &buffers.y, &buffers.z, &buffers.base, &buffers.gain}) v->assign(room, nan);
    std::vector<float> sums(static_cast<std::size_t>(tiles_x_)), counts(static_cast<std::size_t>(tiles_x_));
    MeshRowSums found;
    for (int tile_row = static_cast<int>(begin); tile_row < end; ++tile_row) {
      const TileSpan span = spans.empty() ? TileSpan{0, tiles_x_} : spans[static_cast<std::size_t>(tile_row)];
      if (span.begin >= span.end) continue;
      const int left = span.begin * tile_side, right = std::min(width, span.end * tile_side);
      const int first_column =
          (left - mesh.column_step / 2 + mesh.column_step - 1) / mesh.column_step * mesh.column_step + mesh.column_step / 2;
      Band& band = bands_[static_cast<std::size_t>(tile_row)];
      const std::size_t first_tile = static_cast<std::size_t>(tile_row) * static_cast<std::size_t>(tiles_x_);
      std::uint8_t* flags = &tile_high_[first_tile];
      std::fill(sums.begin(), sums.end(), 0.0f), std::fill(counts.begin(), counts.end(), 0.0f);
      const auto check = [&](int column, int row, const float* p) {
        std::uint8_t& flag = flags[column / tile_side];
        if (!flag && pixels.stands(column, row, high) && matters(p, view, wanted)) flag = 1;
      };
      for (int row = tile_row * tile_side; row < std::min(height, (tile_row + 1) * tile_side); ++row) {
        if (row % step == step / 2) {
          const int j = row / base.step;
          const std::size_t at =
              static_cast<std::size_t>(j) * static_cast<std::size_t>(base.nx) + static_cast<std::size_t>(left / base.step);
          const std::size_t below = at + static_cast<std::size_t>(base.nx);
          const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(left);
          const std::size_t cell =
              static_cast<std::size_t>(row / step) * static_cast<std::size_t>(cell_pitch_) + static_cast<std::size_t>(left / cell_columns);
          found.high.clear(), found.seen = found.strays = 0, found.across = 0;
          read_row(isa,
                   {scan.point(first), masked ? masked + first : nullptr, right - left, &u_[static_cast<std::size_t>(left)],
                    &base.depth[at], &base.depth[below], &base.gain[at], &base.gain[below], base.step, base.nx - left / base.step,
                    static_cast<float>(row - j * base.step) / static_cast<float>(base.step), static_cast<float>(view.camera.v(row)),
                    static_cast<float>(options.tolerance / view.camera.f), static_cast<float>(options.reach_mm), high,
                    static_cast<float>(options.clamp_mm), &cell_height_[cell], &sums[static_cast<std::size_t>(span.begin)],
                    &counts[static_cast<std::size_t>(span.begin)]},
                   buffers, found);
          band.seen += found.seen, band.strays += found.strays, band.read += right - left;
          band.across = std::max(band.across, static_cast<double>(found.across));
          for (const int column : found.high) check(left + column, row, scan.point(left + column, row));
          continue;
        }
        for (int column = first_column; column < right; column += mesh.column_step) {
          ++band.read;
          if (row + ahead < height) __builtin_prefetch(scan.point(column, row + ahead));
          const float* p = pixels.seen(column, row);
          if (p && pixels.height(column, row, p) >= high) check(column, row, p);
        }
      }
      for (int i = span.begin; i < span.end; ++i) {
        const auto k = static_cast<std::size_t>(i);
        if (counts[k] > 0) tile_height_[first_tile + k] = sums[k] / counts[k];
      }
    }
  });
  // A short last row of cells may end before its row of the mesh: it takes the values of the row before.
  if (cells_y_ > 1 && height % step != 0 && height % step <= step / 2)
    std::copy(cell_height_.end() - 2 * cell_pitch_, cell_height_.end() - cell_pitch_, cell_height_.end() - cell_pitch_);
  strays_ = seen_ = read_ = 0, across_ = 0;
  for (const Band& band : bands_) strays_ += band.strays, seen_ += band.seen, read_ += band.read, across_ = std::max(across_, band.across);
}

}  // namespace debulk
