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

// The pixels that the coarse pass reads: every row_step-th row, whole, and every column_step-th column. They are the cords
// of a mesh, and what is connected and holds none of them lies in one of its eyes, (row_step - 1) by (column_step - 1)
// pixels. So nothing with a larger area slips through, whatever its shape or direction: an outline that is to hold
// AreaTol must be crossed by a cord.
struct Mesh {
  int row_step = 0, column_step = 0;  // powers of two; row_step 1 to 16. 0: no mesh is fine enough
  double pixel_mm = 0;                // longest side of a pixel on the reference, in the mold's XY plane
  double pixel_mm2 = 0;               // its largest area

  bool exists() const { return row_step > 0; }
  double eye_mm2() const { return row_step * column_step * pixel_mm2; }
};

// The widest mesh whose eyes hold half of the area at most and whose rows are at most 2.5 mm apart, where `wanted` (of the
// mold's XY) is not 0; without it, on 98 % of the pixels, for beside the mold the reference may fall off steeply.
Mesh choose_mesh(const RayBase& base, const View& view, double area_mm2, const Grid<std::uint8_t>* wanted);

struct MeshOptions {
  double high_mm = 1.0;    // what stands higher, with its neighbours, is part of something high
  double clamp_mm = 2.0;   // of heights in the tiles' means: a flying pixel weighs no more than that
  double reach_mm = 1.0;   // a point without a neighbour in its row that near counts as not seen
  double tolerance = 0.1;  // pixels, of the camera's rays
};

// The tiles of one row of tiles that are read.
struct TileSpan {
  int begin = 0, end = 0;
};

// What one reading along the mesh yields.
class MeshPass {
 public:
  static constexpr int cell_columns = 4;  // a cell: so many pixels of a row of the mesh
  static constexpr int tile_side = 16;    // pixels

  // A high pixel counts if at least 8 of 25 pixels round it (of those that were seen) are high: what is 2 pixels wide in
  // any direction passes, and a single flying pixel or a run of six do not. `wanted`, if given (of the mold's XY), is 0
  // where a high point does not matter. `spans`, one per row of tiles, are what is read; empty: everything.
  void run(const CloudView& scan, const std::uint8_t* masked, const View& view, const Mesh& mesh, const RayBase& base,
           const MeshOptions& options, const Grid<std::uint8_t>* wanted, const std::vector<TileSpan>& spans, int threads, const Stop& stop);

  int cells_x() const { return cells_x_; }
  int cells_y() const { return cells_y_; }
  int cell_pitch() const { return cell_pitch_; }                          // of a row in `cell_height`
  const std::vector<float>& cell_height() const { return cell_height_; }  // mean, NaN where less than half was seen, or read
  int tiles_x() const { return tiles_x_; }
  int tiles_y() const { return tiles_y_; }
  const std::vector<float>& tile_height() const { return tile_height_; }     // clamped mean, NaN: none seen
  const std::vector<std::uint8_t>& tile_high() const { return tile_high_; }  // something high is here
  long strays() const { return strays_; }                                    // points off their rays
  long seen() const { return seen_; }
  long read() const { return read_; }           // pixels
  double across_mm() const { return across_; }  // largest extent along x that a row sees

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
