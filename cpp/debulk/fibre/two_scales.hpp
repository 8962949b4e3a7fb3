#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/fibre/fibre_options.hpp"
#include "debulk/pocket/ply_mask.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// Heights of the ply's upper side above the datum of its thickness (surface/datum.hpp), mm, NaN where nothing is known: of a whole map or
// of windows of it, which may not overlap.
using HeightWindows = std::vector<const Grid<float>*>;

// Whether a place lies in a tile that was made (`raised`), or what is known of it otherwise.
enum class Place : std::uint8_t { flat, raised, unknown, outside };

// What a line needs at its points, one after the other. The lengths are NaN where a point is not raised, or not known.
struct GapsAt {
  Place* place;
  double *fine, *coarse;  // mm, the ply's lower side above the mold, by the finer and the coarser mean
  double* mold;           // mm, height of the mold
};

// The gap below the ply at two scales: means of the heights over squares of `fine` and of 2 fine + 1 cells, over the
// points that are known, less the thickness. They are made tile by tile, and only where the ply
// stands off the mold or next to it: elsewhere no line has an excess.
class TwoScales {
 public:
  // Reads all windows, tile by tile on several threads. The windows and `memory`, which grows as needed, must outlive the
  // result. Throws Stopped.
  static std::vector<TwoScales> of(const HeightWindows& windows, const Polygon& ply, const Surface& mold, const FibreOptions& options,
                                   std::vector<float>& memory, const Stop& stop);

  // Looks up `count` places, given by their coordinates, mm.
  void look_up(const double* x, const double* y, int count, const GapsAt& out) const;

  const Grid<float>& heights() const { return heights_; }
  int fine_cells() const { return fine_cells_; }
  double spacing() const { return heights_.spacing; }
  // Variance, mm2 along x and along y, by which the finer and the coarser heights are blurred in all.
  double fine_blur_mm2() const { return blur_mm2(fine_cells_); }
  double coarse_blur_mm2() const { return blur_mm2(2 * fine_cells_ + 1); }

 private:
  struct Workspace;

  TwoScales(const Grid<float>& heights, const FibreOptions& options);
  void find_raised(int tile_row, float high);
  void choose_tiles();
  void make(std::size_t tile, const Surface& mold, Workspace& work);
  double blur_mm2(int cells) const;

  const Grid<float>& heights_;
  PlyMask ply_;
  double thickness_, blur_cells2_;
  Isa isa_;
  int fine_cells_, columns_, rows_;
  std::vector<std::int32_t> tiles_;  // the number of its values, or what else is known of it
  std::vector<std::uint8_t> raised_;
  std::vector<std::array<int, 2>> made_;  // column and row of the tiles that were made
  float* values_ = nullptr;               // of these tiles, one after the other: kEach floats, point by point
};

}  // namespace debulk
