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

constexpr int kTileBits = 5, kTile = 1 << kTileBits;  // cells on a side of a tile
constexpr int kTileSide = kTile + 1;                  // points on it: neighbouring tiles share a row of points
constexpr int kTileStride = 48;                       // floats in a row of a tile: three wide registers

// What the tiles over one ply on one mold have in common in scan after scan.
struct TileMemory {
  Grid<float> place;                     // the grid of the heights, without values
  int edge_cells = 0;                    // that were left out along the edge
  PlyMask ply;                           // without these
  std::vector<std::vector<float>> mold;  // height of the mold on each tile that was ever made, see GapTiles::Maker
};

// The gap below the ply at two scales: means of the heights over squares of `fine` and of 2 fine + 1 cells, over the
// points that are known, less the thickness. They are made tile by tile, and only where the ply stands off the mold or
// next to it: elsewhere no line has an excess.
class GapTiles {
 public:
  static constexpr std::int32_t kFlat = -1, kGaps = -2;  // tiles without values; in the second kind some heights are not known

  // heights: of the ply's upper side above the datum of its thickness (surface/datum.hpp), mm, NaN where nothing is
  // known; they must outlive the tiles. memory: of the tiles before, over the same ply on the same mold; null: none. Throws
  // Stopped.
  GapTiles(const Grid<float>& heights, const Polygon& ply, const FibreOptions& options, const Stop& stop, TileMemory* memory = nullptr);
  GapTiles(const GapTiles&) = delete;
  GapTiles& operator=(const GapTiles&) = delete;

  const Grid<float>& heights() const { return heights_; }
  // Whether the cell at a place has four corners on the ply, none of them so near to its edge that its height may be
  // partly the mold's. The heights of others are not used.
  bool on_ply(const Eigen::Vector2d& xy) const;
  double edge_mm() const { return edge_cells_ * heights_.spacing; }
  int columns() const { return columns_; }
  // Per tile, row by row: its number among those with values, or what else is known of it.
  const std::vector<std::int32_t>& numbers() const { return numbers_; }
  // Column and row of the tiles with values.
  const std::vector<std::array<int, 2>>& raised() const { return raised_; }
  int fine_cells() const { return fine_cells_; }
  // Variance, mm2 along x and along y, by which the finer and the coarser heights are blurred in all.
  double fine_blur_mm2() const { return blur_mm2(fine_cells_); }
  double coarse_blur_mm2() const { return blur_mm2(2 * fine_cells_ + 1); }

  // Makes the values of one tile after the other, in memory that is used again.
  class Maker {
   public:
    Maker(const GapTiles& tiles, const Surface& mold);
    void make(std::size_t number);
    // mm, in kTileSide rows of kTileStride: the ply's lower side above the mold by either mean, NaN where it is not
    // known, and the height of the mold.
    std::vector<float> fine, coarse;
    const float* mold = nullptr;

   private:
    void copy_known(int i0, int j0);
    void read_mold(int i0, int j0, std::vector<float>& out);

    const GapTiles& tiles_;
    const Surface& surface_;
    const int border_, stride_, rows_;  // of the copy of a tile with what its means reach beyond it
    std::vector<float> values_, known_, narrow_, broad_, fine_count_, coarse_count_;
    const std::vector<std::uint8_t> all_on_;  // a row of a ply whose outline is not known
    Grid<double> heights_;
    std::vector<float> mold_;  // if the tiles have no memory
  };

 private:
  void look_over(int tile_row, float high, std::vector<std::uint8_t>& above);
  double blur_mm2(int cells) const;

  const Grid<float>& heights_;
  TileMemory own_;  // with the mask alone
  TileMemory* kept_;
  double thickness_, blur_cells2_;
  Isa isa_;
  int edge_cells_, fine_cells_, columns_, rows_;
  std::vector<std::int32_t> numbers_;
  std::vector<std::array<int, 2>> raised_;
};

}  // namespace debulk
