#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/fibre/fibre_options.hpp"
#include "debulk/pocket/ply_mask.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// What a line needs at one place. NaN where it is not known.
struct ScaleSample {
  double fine, coarse;  // mm, the ply's lower side above the mold, by the finer and the coarser mean
  double mold;          // mm, height of the mold
};

// The gap below the ply at two scales: means of the heights over squares of `fine` and of 2 fine + 1 cells, over the
// points that are known, less the thickness along the mold's normal. They are made tile by tile, and only where the ply
// stands off the mold or next to it: elsewhere no line has an excess.
class TwoScales {
 public:
  // heights: of the ply's upper side above the mold, mm, NaN where nothing is known. Throws Stopped.
  TwoScales(const Grid<float>& heights, const PlyMask& ply, const Surface& mold, const FibreOptions& options, const Stop& stop);

  enum class Place : std::uint8_t { flat, raised, unknown, outside };
  // Whether the place lies in a tile that was made (`raised`), or what is known of it otherwise.
  Place place(const Eigen::Vector2d& xy) const;
  // In a raised tile only.
  ScaleSample sample(const Eigen::Vector2d& xy) const;

  int fine_cells() const { return fine_cells_; }
  double spacing() const { return heights_.spacing; }
  // Variance, mm2 along x and along y, by which the finer and the coarser heights are blurred in all.
  double fine_blur_mm2() const { return blur_mm2(fine_cells_); }
  double coarse_blur_mm2() const { return blur_mm2(2 * fine_cells_ + 1); }

 private:
  enum Tile : std::int32_t { kFlat = -1, kGaps = -2 };  // else the number of its values

  double blur_mm2(int cells) const;
  void make(int tile_i, int tile_j, const Surface& mold);
  float height(int i, int j) const;

  const Grid<float>& heights_;
  const PlyMask& ply_;
  double thickness_, blur_cells2_;
  int fine_cells_, columns_, rows_;
  std::vector<std::int32_t> tiles_;
  std::vector<float> fine_, coarse_, mold_;  // of the tiles that were made, one after the other
};

}  // namespace debulk
