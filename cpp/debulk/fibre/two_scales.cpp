#include "debulk/fibre/two_scales.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "debulk/core/parallel.hpp"
#include "debulk/fibre/tile_rows.hpp"

namespace debulk {
namespace {

constexpr int kTileBits = 5, kTile = 1 << kTileBits;  // cells on a side: neighbouring tiles share a row of points
static_assert(kTileSide == kTile + 1);
constexpr int kPoints = kTileSide * kTileSide;
constexpr double kShare = 0.5;                  // of the mold tolerance: what stands higher makes its tile raised
constexpr std::int32_t kFlat = -1, kGaps = -2;  // tiles without values; in the second kind some heights are not known
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct ScaleTables {
  double x, y, spacing;  // of the heights' grid
  int nx, ny;
  const float* heights;
  const std::int32_t* tiles;
  int columns;  // of tiles
  const float* values;
};

#define DEBULK_KERNEL "debulk/fibre/look_up_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

int odd_cells(double length, double spacing) {
  if (length <= 0) return 1;
  const int cells = std::max(3, static_cast<int>(std::lround(length / spacing)));
  return cells + (cells % 2 == 0);
}

// The largest float that is not above a value: a float is above the one exactly if it is above the other.
float float_below(double value) {
  const auto near = static_cast<float>(value);
  return near > value ? std::nextafter(near, -std::numeric_limits<float>::infinity()) : near;
}

}  // namespace

// A tile with a border, and the sums over its squares.
struct TwoScales::Workspace {
  explicit Workspace(int border_) : border(border_), stride(kTileStride + 2 * border_), rows(kTileSide + 2 * border_) {
    values.assign(static_cast<std::size_t>(stride) * rows, 0.0F), known = values, all_on.assign(static_cast<std::size_t>(stride), 1);
    for (std::vector<float>* sums : {&fine, &coarse, &fine_count, &coarse_count})
      sums->resize(static_cast<std::size_t>(kTileSide) * kTileStride);
  }

  // Sets heights, 0 where they are not known, and if any is not, whether they are known, 1 or 0. Returns whether all are.
  bool read(const Grid<float>& heights, const PlyMask& ply, int i0, int j0) {
    const int wide = kTileSide + 2 * border, first = std::clamp(-i0, 0, wide), end = std::clamp(heights.nx - i0, first, wide);
    const auto on_ply = [&](int j) { return ply.known() ? ply.row(j) + i0 + first : all_on.data(); };
    bool whole = first == 0 && end == wide && j0 >= 0 && j0 + rows <= heights.ny;
    for (int j = 0; whole && j < rows; ++j) {
      const float* h = &heights.at(i0, j0 + j);
      std::copy_n(h, wide, &values[static_cast<std::size_t>(j) * stride]);
      const std::uint8_t* on = on_ply(j0 + j);
      whole = count_row(h, wide, 0.0F).gaps == 0 && std::find(on, on + wide, 0) == on + wide;
    }
    if (whole) return true;
    for (int j = 0; j < rows; ++j) {
      float* value = &values[static_cast<std::size_t>(j) * stride];
      float* is_known = &known[static_cast<std::size_t>(j) * stride];
      std::fill_n(value, wide, 0.0F), std::fill_n(is_known, wide, 0.0F);
      if (j0 + j < 0 || j0 + j >= heights.ny || first == end) continue;
      copy_known(&heights.at(i0 + first, j0 + j), on_ply(j0 + j), end - first, value + first, is_known + first);
    }
    return false;
  }

  void add_up(int r, bool all_known, std::vector<float>& sums, std::vector<float>& counts) {
    square_sums(values.data(), border, r, along, sums.data());
    if (all_known)
      std::fill(counts.begin(), counts.end(), static_cast<float>((2 * r + 1) * (2 * r + 1)));
    else
      square_sums(known.data(), border, r, along, counts.data());
  }

  const int border, stride, rows;
  std::vector<std::uint8_t> all_on;  // a row of a ply whose outline is not known
  std::vector<float> values, known, along, fine, coarse, fine_count, coarse_count;
};

std::vector<TwoScales> TwoScales::of(const HeightWindows& windows, const Polygon& ply, const Surface& mold, const FibreOptions& options,
                                     std::vector<float>& memory, const Stop& stop) {
  struct Task {
    TwoScales* scales;
    std::size_t number;
  };
  std::vector<TwoScales> out;
  out.reserve(windows.size());
  std::vector<Task> rows, tiles;
  for (const Grid<float>* heights : windows) {
    out.push_back(TwoScales(*heights, options));
    for (int row = 0; row < out.back().rows_; ++row) rows.push_back({&out.back(), static_cast<std::size_t>(row)});
  }
  const float high = float_below(options.thickness + kShare * options.mold_tol);
  parallel_for(static_cast<long>(rows.size()), 4, options.threads, stop, [&](long begin, long end) {
    for (long k = begin; k < end; ++k) {
      const Task& task = rows[static_cast<std::size_t>(k)];
      task.scales->find_raised(static_cast<int>(task.number), high);
    }
  });
  parallel_for(static_cast<long>(out.size()), 1, options.threads, stop, [&](long begin, long end) {
    for (long k = begin; k < end; ++k) {
      TwoScales& scales = out[static_cast<std::size_t>(k)];
      scales.choose_tiles();
      if (!ply.empty() && !scales.made_.empty()) scales.ply_ = PlyMask(ply, scales.heights_);
    }
  });
  for (TwoScales& scales : out)
    for (std::size_t tile = 0; tile < scales.made_.size(); ++tile) tiles.push_back({&scales, tile});
  constexpr std::size_t each = static_cast<std::size_t>(kPoints) * kEach;
  if (memory.size() < tiles.size() * each) memory = std::vector<float>(tiles.size() * each);
  float* next = memory.data();
  for (TwoScales& scales : out) scales.values_ = next, next += scales.made_.size() * each;
  parallel_for(static_cast<long>(tiles.size()), 8, options.threads, stop, [&](long begin, long end) {
    std::unique_ptr<Workspace> work;
    for (long k = begin; k < end; ++k) {
      const Task& task = tiles[static_cast<std::size_t>(k)];
      if (!work || work->border != task.scales->fine_cells_) work = std::make_unique<Workspace>(task.scales->fine_cells_);
      task.scales->make(task.number, mold, *work);
    }
  });
  return out;
}

TwoScales::TwoScales(const Grid<float>& heights, const FibreOptions& options)
    : heights_(heights),
      thickness_(options.thickness),
      blur_cells2_(options.blur_cells2),
      isa_(options.isa),
      fine_cells_(odd_cells(options.fine_mm, heights.spacing)),
      columns_(std::max(0, heights.nx - 2) / kTile + 1),
      rows_(std::max(0, heights.ny - 2) / kTile + 1),
      tiles_(static_cast<std::size_t>(columns_) * rows_, kFlat),
      raised_(tiles_.size(), 0) {}

void TwoScales::find_raised(int tile_row, float high) {
  const int last_j = std::min((tile_row + 1) * kTile, heights_.ny - 1);
  for (int column = 0; column < columns_; ++column) {
    const std::size_t tile = static_cast<std::size_t>(tile_row) * columns_ + column;
    const int first = column * kTile, count = std::min(kTileSide, heights_.nx - first);
    RowCounts in_all;
    for (int j = tile_row * kTile; j <= last_j; ++j) {
      const RowCounts here = count_row(&heights_.at(first, j), count, high);
      in_all.gaps += here.gaps, in_all.above += here.above;
    }
    raised_[tile] = in_all.above > 0;
    if (in_all.gaps > 0) tiles_[tile] = kGaps;
  }
}

// Tails below the tolerance and the flat ply whose noise counts lie beside what stands up.
void TwoScales::choose_tiles() {
  for (int tj = 0; tj < rows_; ++tj)
    for (int ti = 0; ti < columns_; ++ti) {
      bool near = false;
      for (int j = std::max(0, tj - 1); j <= std::min(rows_ - 1, tj + 1); ++j)
        for (int i = std::max(0, ti - 1); i <= std::min(columns_ - 1, ti + 1); ++i)
          near = near || raised_[static_cast<std::size_t>(j) * columns_ + i];
      if (!near) continue;
      tiles_[static_cast<std::size_t>(tj) * columns_ + ti] = static_cast<std::int32_t>(made_.size());
      made_.push_back({ti, tj});
    }
}

double TwoScales::blur_mm2(int cells) const {
  return ((cells * cells - 1) / 12.0 + blur_cells2_) * heights_.spacing * heights_.spacing;
}

void TwoScales::make(std::size_t tile, const Surface& mold, Workspace& work) {
  const int i0 = made_[tile][0] * kTile, j0 = made_[tile][1] * kTile;
  const bool all_known = work.read(heights_, ply_, i0 - work.border, j0 - work.border);
  work.add_up(fine_cells_ / 2, all_known, work.fine, work.fine_count);
  work.add_up(fine_cells_, all_known, work.coarse, work.coarse_count);
  Grid<double> m(kTileSide, kTileSide, heights_.position(i0, j0), heights_.spacing);
  mold.heights_on(m, 1);
  for (int j = 0; j < kTileSide; ++j) {
    const std::size_t sums = static_cast<std::size_t>(j) * kTileStride;
    const float* known = all_known ? nullptr : &work.known[static_cast<std::size_t>(j + work.border) * work.stride + work.border];
    const TileRow row{&work.fine[sums], &work.fine_count[sums], &work.coarse[sums], &work.coarse_count[sums], known, &m.at(0, j)};
    write_points(row, thickness_, &values_[(tile * kPoints + static_cast<std::size_t>(j) * kTileSide) * kEach]);
  }
}

void TwoScales::look_up(const double* x, const double* y, int count, const GapsAt& out) const {
  const Grid<float>& h = heights_;
  const ScaleTables tables{h.origin.x(), h.origin.y(), h.spacing, h.nx, h.ny, h.values.data(), tiles_.data(), columns_, values_};
  DEBULK_ON(isa_, look_up(tables, x, y, count, out));
}

}  // namespace debulk
