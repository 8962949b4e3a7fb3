#include "debulk/fibre/two_scales.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int kTile = 32;         // cells on a side
constexpr int kSide = kTile + 1;  // points on a side: neighbouring tiles share a row, so that every cell has its four corners
constexpr int kValues = kSide * kSide;
constexpr double kShare = 0.5;  // of the mold tolerance: what stands higher makes its tile raised
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// Sums over squares of 2 r + 1 points of a patch, by running sums along rows and then along columns. A patch has a
// border of r points round the kSide by kSide points that are wanted.
class SquareMeans {
 public:
  // `values` and `known` have `side` points in a row; unknown values are 0.
  SquareMeans(const std::vector<float>& values, const std::vector<float>& known, int side, int border, int r)
      : sums_(of(values, side, border, r)), counts_(of(known, side, border, r)) {}
  float at(int k) const { return sums_[static_cast<std::size_t>(k)] / counts_[static_cast<std::size_t>(k)]; }

 private:
  static std::vector<float> of(const std::vector<float>& values, int side, int border, int r) {
    std::vector<float> along(static_cast<std::size_t>(side) * kSide), out(static_cast<std::size_t>(kValues), 0.0F);
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < kSide; ++i) {
        float sum = 0;  // summed afresh at each point: running sums would let the rounding depend on the tile
        const float* row = &values[static_cast<std::size_t>(j) * side + i + border - r];
        for (int k = 0; k <= 2 * r; ++k) sum += row[k];
        along[static_cast<std::size_t>(j) * kSide + i] = sum;
      }
    for (int j = 0; j < kSide; ++j)
      for (int k = 0; k <= 2 * r; ++k) {
        const float* row = &along[static_cast<std::size_t>(j + border - r + k) * kSide];
        float* to = &out[static_cast<std::size_t>(j) * kSide];
        for (int i = 0; i < kSide; ++i) to[i] += row[i];
      }
    return out;
  }

  std::vector<float> sums_, counts_;
};

int odd_cells(double length, double spacing) {
  if (length <= 0) return 1;
  const int cells = std::max(3, static_cast<int>(std::lround(length / spacing)));
  return cells + (cells % 2 == 0);
}

double bilinear(const float* low, double u, double v) {
  const float* high = low + kSide;
  return (1 - v) * ((1 - u) * low[0] + u * low[1]) + v * ((1 - u) * high[0] + u * high[1]);
}

}  // namespace

TwoScales::TwoScales(const Grid<float>& heights, const PlyMask& ply, const Surface& mold, const FibreOptions& options, const Stop& stop)
    : heights_(heights),
      ply_(ply),
      thickness_(options.thickness),
      blur_cells2_(options.blur_cells2),
      fine_cells_(odd_cells(options.fine_mm, heights.spacing)),
      columns_(std::max(0, heights.nx - 2) / kTile + 1),
      rows_(std::max(0, heights.ny - 2) / kTile + 1),
      tiles_(static_cast<std::size_t>(columns_) * rows_, kFlat) {
  const double high = options.thickness + kShare * options.mold_tol;
  std::vector<std::uint8_t> raised(tiles_.size(), 0);
  parallel_for(rows_, 1, options.threads, stop, [&](long begin, long end) {
    for (int tj = static_cast<int>(begin); tj < end; ++tj)
      for (int ti = 0; ti < columns_; ++ti) {
        const std::size_t tile = static_cast<std::size_t>(tj) * columns_ + ti;
        const int last_i = std::min((ti + 1) * kTile, heights_.nx - 1), last_j = std::min((tj + 1) * kTile, heights_.ny - 1);
        int gaps = 0, above = 0;
        for (int j = tj * kTile; j <= last_j; ++j)
          for (int i = ti * kTile; i <= last_i; ++i) {
            const float h = heights_.at(i, j);
            gaps += std::isnan(h), above += h > high;
          }
        raised[tile] = above > 0;
        if (gaps > 0) tiles_[tile] = kGaps;
      }
  });
  // Tails below the tolerance and the flat ply whose noise counts lie beside what stands up.
  std::vector<std::array<int, 2>> wanted;
  for (int tj = 0; tj < rows_; ++tj)
    for (int ti = 0; ti < columns_; ++ti) {
      bool near = false;
      for (int j = std::max(0, tj - 1); j <= std::min(rows_ - 1, tj + 1); ++j)
        for (int i = std::max(0, ti - 1); i <= std::min(columns_ - 1, ti + 1); ++i)
          near = near || raised[static_cast<std::size_t>(j) * columns_ + i];
      if (!near) continue;
      tiles_[static_cast<std::size_t>(tj) * columns_ + ti] = static_cast<std::int32_t>(wanted.size());
      wanted.push_back({ti, tj});
    }
  for (std::vector<float>* values : {&fine_, &coarse_, &mold_}) values->resize(wanted.size() * kValues);
  parallel_for(static_cast<long>(wanted.size()), 4, options.threads, stop, [&](long begin, long end) {
    for (long k = begin; k < end; ++k) make(wanted[static_cast<std::size_t>(k)][0], wanted[static_cast<std::size_t>(k)][1], mold);
  });
}

double TwoScales::blur_mm2(int cells) const {
  return ((cells * cells - 1) / 12.0 + blur_cells2_) * heights_.spacing * heights_.spacing;
}

float TwoScales::height(int i, int j) const {
  return heights_.contains(i, j) && ply_.on_ply(i, j) ? heights_.at(i, j) : kUnknown;
}

void TwoScales::make(int tile_i, int tile_j, const Surface& mold) {
  const int border = fine_cells_, side = kSide + 2 * border, i0 = tile_i * kTile, j0 = tile_j * kTile;
  std::vector<float> values(static_cast<std::size_t>(side) * side), known(values.size());
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const float h = height(i0 + i - border, j0 + j - border);
      const std::size_t at = static_cast<std::size_t>(j) * side + i;
      known[at] = std::isnan(h) ? 0.0F : 1.0F;
      values[at] = std::isnan(h) ? 0.0F : h;
    }
  const SquareMeans fine(values, known, side, border, fine_cells_ / 2), coarse(values, known, side, border, fine_cells_);
  // The mold on the tile with a border of one point, for its slopes.
  Grid<double> m(kSide + 2, kSide + 2, heights_.position(i0 - 1, j0 - 1), heights_.spacing);
  mold.heights_on(m, 1);
  const std::size_t first = static_cast<std::size_t>(tiles_[static_cast<std::size_t>(tile_j) * columns_ + tile_i]) * kValues;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const int k = j * kSide + i;
      const double rise_x = (m.at(i + 2, j + 1) - m.at(i, j + 1)) / (2 * heights_.spacing);
      const double rise_y = (m.at(i + 1, j + 2) - m.at(i + 1, j)) / (2 * heights_.spacing);
      // A ply of the thickness t along the normal stands t / cos(slope) high along z.
      const double upright = thickness_ * std::sqrt(1 + rise_x * rise_x + rise_y * rise_y);
      const bool seen = known[static_cast<std::size_t>(j + border) * side + i + border] > 0;
      fine_[first + k] = seen ? static_cast<float>(fine.at(k) - upright) : kUnknown;
      coarse_[first + k] = seen ? static_cast<float>(coarse.at(k) - upright) : kUnknown;
      mold_[first + k] = static_cast<float>(m.at(i + 1, j + 1));
    }
}

TwoScales::Place TwoScales::place(const Eigen::Vector2d& xy) const {
  const Eigen::Vector2d at = heights_.locate(xy);
  if (!(at.x() >= 0 && at.y() >= 0 && at.x() < heights_.nx - 1 && at.y() < heights_.ny - 1)) return Place::outside;
  const std::int32_t tile = tiles_[static_cast<std::size_t>(at.y()) / kTile * columns_ + static_cast<std::size_t>(at.x()) / kTile];
  if (tile >= 0) return Place::raised;
  if (tile == kFlat) return Place::flat;
  return std::isnan(heights_.at(static_cast<int>(at.x() + 0.5), static_cast<int>(at.y() + 0.5))) ? Place::unknown : Place::flat;
}

ScaleSample TwoScales::sample(const Eigen::Vector2d& xy) const {
  const Eigen::Vector2d at = heights_.locate(xy);
  const int i = static_cast<int>(at.x()), j = static_cast<int>(at.y()), ti = i / kTile, tj = j / kTile;
  const std::size_t from = static_cast<std::size_t>(tiles_[static_cast<std::size_t>(tj) * columns_ + ti]) * kValues +
                           static_cast<std::size_t>(j - tj * kTile) * kSide + (i - ti * kTile);
  const double u = at.x() - i, v = at.y() - j;
  return {bilinear(&fine_[from], u, v), bilinear(&coarse_[from], u, v), bilinear(&mold_[from], u, v)};
}

}  // namespace debulk
