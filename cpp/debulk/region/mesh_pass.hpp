#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "debulk/cloud/pinhole_outliers.hpp"
#include "debulk/core/grid.hpp"
#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/image_gridding.hpp"

namespace debulk {

// The pixels that the coarse pass reads: every row_step-th row in full, and every column_step-th column. They are the
// cords of a mesh. A connected area that contains no pixel of a cord lies within one eye of the mesh, (row_step - 1) by
// (column_step - 1) pixels. So no larger area is missed, whatever its shape or direction: an outline that encloses
// AreaTol is always crossed by a cord.
struct Mesh {
  int row_step = 0, column_step = 0;  // powers of two; row_step is 1 to 16. 0: no mesh is fine enough
  double pixel_mm = 0;                // longest side of a pixel on the reference, in the mold's XY plane
  double pixel_mm2 = 0;               // largest area of a pixel there

  bool exists() const { return row_step > 0; }
  double eye_mm2() const { return row_step * column_step * pixel_mm2; }
};

// Returns the widest mesh whose eyes cover at most half of the area and whose rows are at most 2.5 mm apart wherever
// `wanted` (a grid in the mold's XY) is not 0. Without `wanted` this holds on 98 % of the pixels, because the reference
// may fall off steeply beside the mold.
Mesh choose_mesh(const RayBase& base, const View& view, double area_mm2, const Grid<std::uint8_t>* wanted);

struct MeshOptions {
  double high_mm = 1.0;    // a pixel above this height is high, if enough of its neighbours are high too
  double clamp_mm = 2.0;   // heights are limited to this in the tiles' means, so that a flying pixel weighs no more
  double reach_mm = 1.0;   // a point with no neighbour in its row within this distance counts as not seen
  double tolerance = 0.1;  // pixels; a point farther than this from its camera ray counts as off its ray
};

// The range of tiles that is read in one row of tiles.
struct TileSpan {
  int begin = 0, end = 0;
};

// Reads the scan once along the mesh and keeps the heights of cells and tiles.
class MeshPass {
 public:
  static constexpr int cell_columns = 4;  // pixels of a row of the mesh that form one cell
  static constexpr int tile_side = 16;    // pixels

  // A high pixel counts if at least 8 of the 25 pixels round it (of those that were seen) are high. An elevation 2
  // pixels wide in any direction passes this test; a single flying pixel or a run of six does not. `wanted`, if given
  // (a grid in the mold's XY), is 0 where a high point does not matter. `spans`, one per row of tiles, say which tiles
  // are read; if it is empty, all are.
  void run(const CloudView& scan, const std::uint8_t* masked, const View& view, const Mesh& mesh, const RayBase& base,
           const MeshOptions& options, const Grid<std::uint8_t>* wanted, const std::vector<TileSpan>& spans, int threads, const Stop& stop);

  int cells_x() const { return cells_x_; }
  int cells_y() const { return cells_y_; }
  int cell_pitch() const { return cell_pitch_; }                          // length of a row in `cell_height`
  const std::vector<float>& cell_height() const { return cell_height_; }  // mean; NaN where less than half was seen or read
  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }
  const std::vector<float>& tile_height() const { return tile_height_; }     // clamped mean; NaN where none was seen
  const std::vector<std::uint8_t>& tile_high() const { return tile_high_; }  // 1: the tile has a high pixel that counts
  long strays() const { return strays_; }                                    // points off their camera rays
  long seen() const { return seen_; }
  long read() const { return read_; }           // pixels
  double across_mm() const { return across_; }  // largest extent along x that any row sees

 private:
  struct Band {
    long strays = 0, seen = 0, read = 0;
    double across = 0;
  };
  int cells_x_ = 0, cells_y_ = 0, cell_pitch_ = 0, tiles_x_ = 0, tiles_y_ = 0;
  std::vector<float> u_, cell_height_, tile_height_;
  std::vector<std::uint8_t> tile_high_;
  std::vector<Band> bands_;
  long strays_ = 0, seen_ = 0, read_ = 0;
  double across_ = 0;
};

}  // namespace debulk
