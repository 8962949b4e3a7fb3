#include "debulk/fibre/gap_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr double kShare = 0.5;  // of the mold tolerance: what stands higher makes its tile raised
constexpr std::size_t kPoints = static_cast<std::size_t>(kTileSide) * kTileStride;

struct SumMemory {
  float *narrow, *broad;
};

// Floats in a row of the narrower sums, which go on beyond the tile for the wider ones: a multiple of the lanes.
int sum_stride(int r) {
  return (kTileSide + 2 * (r + 1) + 15) / 16 * 16;
}

#define DEBULK_KERNEL "debulk/fibre/tile_kernel.inl"
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

GapTiles::GapTiles(const Grid<float>& heights, const Polygon& ply, const FibreOptions& options, const Stop& stop, TileMemory* memory)
    : heights_(heights),
      kept_(memory != nullptr ? memory : &own_),
      thickness_(options.thickness),
      blur_cells2_(options.blur_cells2),
      isa_(options.isa),
      edge_cells_(options.edge_cells),
      fine_cells_(odd_cells(options.fine_mm, heights.spacing)),
      columns_(std::max(0, heights.nx - 2) / kTile + 1),
      rows_(std::max(0, heights.ny - 2) / kTile + 1),
      numbers_(static_cast<std::size_t>(columns_) * rows_, kFlat) {
  std::vector<std::uint8_t> above(numbers_.size(), 0);
  const float high = float_below(options.thickness + kShare * options.mold_tol);
  parallel_for(rows_, 4, options.threads, stop, [&](long begin, long end) {
    for (long row = begin; row < end; ++row) look_over(static_cast<int>(row), high, above);
  });
  // Tails below the tolerance and the flat ply whose noise counts lie beside what stands up.
  for (int tj = 0; tj < rows_; ++tj)
    for (int ti = 0; ti < columns_; ++ti) {
      bool near = false;
      for (int j = std::max(0, tj - 1); j <= std::min(rows_ - 1, tj + 1); ++j)
        for (int i = std::max(0, ti - 1); i <= std::min(columns_ - 1, ti + 1); ++i)
          near = near || above[static_cast<std::size_t>(j) * columns_ + i] != 0;
      if (!near) continue;
      numbers_[static_cast<std::size_t>(tj) * columns_ + ti] = static_cast<std::int32_t>(raised_.size());
      raised_.push_back({ti, tj});
    }
  const Grid<float>& place = kept_->place;
  const bool same = place.nx == heights.nx && place.ny == heights.ny && place.origin == heights.origin &&
                    place.spacing == heights.spacing && kept_->edge_cells == edge_cells_;
  if (same) return;
  *kept_ = {};
  if (raised_.empty()) return;
  kept_->place.nx = heights.nx, kept_->place.ny = heights.ny, kept_->place.origin = heights.origin, kept_->place.spacing = heights.spacing;
  kept_->edge_cells = edge_cells_;
  if (!ply.empty()) kept_->ply = PlyMask(ply, heights_, edge_cells_);
  if (kept_ != &own_) kept_->mold.resize(numbers_.size());
}

void GapTiles::look_over(int tile_row, float high, std::vector<std::uint8_t>& above) {
  std::vector<std::uint8_t> gaps(static_cast<std::size_t>(columns_), 0);
  const std::size_t first = static_cast<std::size_t>(tile_row) * columns_;
  for (int j = tile_row * kTile; j <= std::min((tile_row + 1) * kTile, heights_.ny - 1); ++j)
    DEBULK_ON(isa_, look_over(&heights_.at(0, j), heights_.nx, columns_, high, &above[first], gaps.data()));
  for (std::size_t column = 0; column < gaps.size(); ++column)
    if (gaps[column] != 0) numbers_[first + column] = kGaps;
}

bool GapTiles::on_ply(const Eigen::Vector2d& xy) const {
  const PlyMask& ply = kept_->ply;
  if (!ply.known()) return true;
  const Eigen::Vector2d at = heights_.locate(xy);
  if (!(at.minCoeff() >= 0 && at.x() < heights_.nx - 1 && at.y() < heights_.ny - 1)) return false;
  const int i = static_cast<int>(at.x()), j = static_cast<int>(at.y());
  return ply.on_ply(i, j) && ply.on_ply(i + 1, j) && ply.on_ply(i, j + 1) && ply.on_ply(i + 1, j + 1);
}

double GapTiles::blur_mm2(int cells) const {
  return ((cells * cells - 1) / 12.0 + blur_cells2_) * heights_.spacing * heights_.spacing;
}

GapTiles::Maker::Maker(const GapTiles& tiles, const Surface& mold_surface)
    : fine(kPoints),
      coarse(kPoints),
      tiles_(tiles),
      surface_(mold_surface),
      border_(tiles.fine_cells_),
      stride_(sum_stride(border_ / 2) + 2 * border_),
      rows_(kTileSide + 2 * border_),
      narrow_(static_cast<std::size_t>(rows_ + 1) * sum_stride(border_ / 2)),
      broad_(static_cast<std::size_t>(rows_) * kTileStride),
      fine_count_(kPoints),
      coarse_count_(kPoints),
      all_on_(static_cast<std::size_t>(stride_), 1),
      heights_(kTileSide, kTileSide, {0, 0}, tiles.heights_.spacing) {}

// Sets heights, 0 where they are not known or not on the ply, and whether they are known, 1 or 0.
void GapTiles::Maker::copy_known(int i0, int j0) {
  const Grid<float>& heights = tiles_.heights_;
  values_.assign(static_cast<std::size_t>(stride_) * rows_, 0.0F), known_ = values_;
  const int first = std::max(0, -i0), count = std::min(kTileSide + 2 * border_, heights.nx - i0) - first;
  for (int j = std::max(0, -j0); count > 0 && j < std::min(rows_, heights.ny - j0); ++j) {
    const std::size_t at = static_cast<std::size_t>(j) * stride_ + first;
    const std::uint8_t* on = tiles_.kept_->ply.known() ? tiles_.kept_->ply.row(j0 + j) + i0 + first : all_on_.data();
    DEBULK_ON(tiles_.isa_, copy_known(&heights.at(i0 + first, j0 + j), on, count, &values_[at], &known_[at]));
  }
}

void GapTiles::Maker::make(std::size_t number) {
  const Grid<float>& heights = tiles_.heights_;
  const PlyMask& ply = tiles_.kept_->ply;
  const int i0 = tiles_.raised_[number][0] * kTile, j0 = tiles_.raised_[number][1] * kTile, b = border_, r = border_ / 2;
  const int left = i0 - b, low = j0 - b;
  const auto thickness = static_cast<float>(tiles_.thickness_);
  const auto of_square = [](int half) { return static_cast<float>((2 * half + 1) * (2 * half + 1)); };
  const SumMemory memory{narrow_.data(), broad_.data()};
  // The sums read whole registers, which reach beyond the tile's last point.
  const int beyond = sum_stride(r);
  bool whole = left >= 0 && low >= 0 && i0 + beyond <= heights.nx && low + rows_ <= heights.ny;
  for (int j = low; whole && j < low + rows_; ++j) whole = ply.covers(j, left, left + kTileSide + 2 * b);
  if (whole) {
    DEBULK_ON(tiles_.isa_, square_sums(&heights.at(i0, j0), heights.nx, r, memory, fine.data(), coarse.data()));
    DEBULK_ON(tiles_.isa_, to_gaps(fine.data(), of_square(r), thickness));
    // A height that is not known makes every sum over it unknown, and each lies in the square of one of the points.
    whole = DEBULK_ON(tiles_.isa_, to_gaps(coarse.data(), of_square(b), thickness));
  }
  if (!whole) {
    copy_known(left, low);
    const std::size_t origin = static_cast<std::size_t>(b) * stride_ + b;
    DEBULK_ON(tiles_.isa_, square_sums(&values_[origin], stride_, r, memory, fine.data(), coarse.data()));
    DEBULK_ON(tiles_.isa_, square_sums(&known_[origin], stride_, r, memory, fine_count_.data(), coarse_count_.data()));
    DEBULK_ON(tiles_.isa_, to_gaps(fine.data(), fine_count_.data(), &known_[origin], stride_, thickness));
    DEBULK_ON(tiles_.isa_, to_gaps(coarse.data(), coarse_count_.data(), &known_[origin], stride_, thickness));
  }
  const auto [column, row] = tiles_.raised_[number];
  const std::size_t tile = static_cast<std::size_t>(row) * tiles_.columns_ + column;
  const bool keep = !tiles_.kept_->mold.empty();
  std::vector<float>& of_tile = keep ? tiles_.kept_->mold[tile] : mold_;
  if (!keep || of_tile.empty()) read_mold(i0, j0, of_tile);
  mold = of_tile.data();
}

void GapTiles::Maker::read_mold(int i0, int j0, std::vector<float>& out) {
  heights_.origin = tiles_.heights_.position(i0, j0);
  surface_.heights_on(heights_, 1);
  out.resize(kPoints);
  for (int j = 0; j < kTileSide; ++j) std::copy_n(&heights_.at(0, j), kTileSide, &out[static_cast<std::size_t>(j) * kTileStride]);
}

}  // namespace debulk
