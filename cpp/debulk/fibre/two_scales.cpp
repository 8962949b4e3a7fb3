#include "debulk/fibre/two_scales.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/parallel.hpp"
#include "debulk/fibre/square_sums.hpp"

namespace debulk {
namespace {

constexpr int kTile = kTileSide - 1;  // cells on a side: neighbouring tiles share a row of points, so that every cell has its corners
constexpr int kPoints = kTileSide * kTileSide;
constexpr int kEach = 4;        // floats of a point, so that one register takes all
constexpr double kShare = 0.5;  // of the mold tolerance: what stands higher makes its tile raised
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

using FloatRow = Eigen::Array<float, kTileSide, 1>;
using Row = Eigen::Array<double, kTileSide, 1>;

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

  // Sets heights, 0 where they are not known, and whether they are known, 1 or 0. Returns whether all are.
  bool read(const Grid<float>& heights, const PlyMask& ply, int i0, int j0) {
    const int wide = kTileSide + 2 * border, first = std::clamp(-i0, 0, wide), end = std::clamp(heights.nx - i0, first, wide);
    int missing = 0;
    for (int j = 0; j < rows; ++j) {
      float* value = &values[static_cast<std::size_t>(j) * stride];
      float* is_known = &known[static_cast<std::size_t>(j) * stride];
      const bool there = j0 + j >= 0 && j0 + j < heights.ny;
      if (!there || first > 0 || end < wide) {
        std::fill_n(value, wide, 0.0F), std::fill_n(is_known, wide, 0.0F);
        missing += 1;
      }
      if (!there || first == end) continue;
      const float* h = &heights.at(i0 + first, j0 + j);
      const std::uint8_t* on = ply.known() ? ply.row(j0 + j) + i0 + first : all_on.data();
      for (int i = 0; i < end - first; ++i) {
        const bool good = (h[i] == h[i]) & (on[i] != 0);
        value[first + i] = good ? h[i] : 0.0F, is_known[first + i] = good ? 1.0F : 0.0F;
        missing += good ? 0 : 1;
      }
    }
    return missing == 0;
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
                                     const Stop& stop) {
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
    int gaps = 0, above = 0;
    for (int j = tile_row * kTile; j <= last_j; ++j) {
      const float* h = &heights_.at(first, j);
      for (int i = 0; i < count; ++i) gaps += h[i] == h[i] ? 0 : 1, above += h[i] > high ? 1 : 0;
    }
    raised_[tile] = above > 0;
    if (gaps > 0) tiles_[tile] = kGaps;
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
  values_.reset(new float[made_.size() * kPoints * kEach]);
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
  using Points = Eigen::Array<float, kEach, kTileSide>;
  for (int j = 0; j < kTileSide; ++j) {
    const auto sums_row = [&](const std::vector<float>& sums) {
      return Eigen::Map<const FloatRow>(&sums[static_cast<std::size_t>(j) * kTileStride]);
    };
    const FloatRow fine = sums_row(work.fine) / sums_row(work.fine_count), coarse = sums_row(work.coarse) / sums_row(work.coarse_count);
    const float* known = &work.known[static_cast<std::size_t>(j + work.border) * work.stride + work.border];
    float* points = &values_[(tile * kPoints + static_cast<std::size_t>(j) * kTileSide) * kEach];
    Eigen::Map<Points> out(points);
    out.row(0) = (fine.cast<double>() - thickness_).cast<float>();
    out.row(1) = (coarse.cast<double>() - thickness_).cast<float>();
    out.row(2) = Eigen::Map<const Row>(&m.at(0, j)).cast<float>();
    out.row(3) = 0;
    for (int i = 0; i < kTileSide; ++i)
      if (!(known[i] > 0)) out(0, i) = out(1, i) = kUnknown;
  }
}

void TwoScales::find(const Eigen::Vector2d& xy, Spot& spot) const {
  const Eigen::Vector2d at = heights_.locate(xy);
  spot.place = Place::outside;
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() < heights_.nx - 1 && at.y() < heights_.ny - 1)) return;
  const int i = static_cast<int>(at.x()), j = static_cast<int>(at.y()), ti = i / kTile, tj = j / kTile;
  const std::int32_t tile = tiles_[static_cast<std::size_t>(tj) * columns_ + ti];
  spot.place = Place::flat;
  if (tile == kFlat) return;
  if (tile == kGaps) {
    if (std::isnan(heights_.at(static_cast<int>(at.x() + 0.5), static_cast<int>(at.y() + 0.5)))) spot.place = Place::unknown;
    return;
  }
  spot.place = Place::raised, spot.u = at.x() - i, spot.v = at.y() - j;
  spot.corner = &values_[(static_cast<std::size_t>(tile) * kPoints + (j - tj * kTile) * kTileSide + (i - ti * kTile)) * kEach];
  __builtin_prefetch(spot.corner), __builtin_prefetch(spot.corner + kTileSide * kEach);
}

ScaleSample TwoScales::sample(const Spot& spot) {
  const auto point = [&](int k) { return Eigen::Map<const Eigen::Array4f>(spot.corner + k * kEach).cast<double>(); };
  const double u = spot.u, v = spot.v;
  const Eigen::Array4d low = (1 - u) * point(0) + u * point(1), high = (1 - u) * point(kTileSide) + u * point(kTileSide + 1);
  const Eigen::Array4d all = (1 - v) * low + v * high;
  return {all[0], all[1], all[2]};
}

}  // namespace debulk
