#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/region/mesh_pass.hpp"
#include "debulk/surface/image_gridding.hpp"

namespace debulk {

// A rectangle of a grid's points, [i0, i1) by [j0, j1).
struct Window {
  int i0, j0, i1, j1;
  double top = 0;  // mm, approximate greatest height in it

  long size() const { return static_cast<long>(i1 - i0) * (j1 - j0); }
  bool overlaps(const Window& o) const { return i0 < o.i1 && o.i0 < i1 && j0 < o.j1 && o.j0 < j1; }
  bool operator==(const Window& o) const { return i0 == o.i0 && j0 == o.j0 && i1 == o.i1 && j1 == o.j1; }
};

// Replaces overlapping windows by the one that contains both, until none overlap; sorted by rows and columns.
std::vector<Window> merged(std::vector<Window> windows);

// The blocks of 16 by 16 points of a grid in which the heights are to be exact.
struct Blocks {
  static constexpr int side = 16;

  explicit Blocks(const Grid<float>& frame = {});
  bool wanted(int i, int j) const { return top.at(i, j) >= 0; }  // i and j count blocks
  void add(const Window& points, double height);                 // marks every block that these points touch as wanted
  // Returns rectangles that cover the window's wanted blocks without overlap. They are few and large, because the image
  // part of each reaches `margin` points beyond it; but a rectangle is split where its unwanted blocks would cost more
  // than that margin.
  std::vector<Window> rectangles(const Window& window, double margin) const;

  int nx = 0, ny = 0;  // points of the frame
  Grid<float> top;     // mm, approximate greatest height in the block; negative: the block is not wanted
};

struct WindowOptions {
  double low_mm = 0.4;     // a tile whose mean height is above this is raised
  double margin_mm = 4.5;  // width of exact heights round raised tiles
};

// Returns windows round all high tiles of the coarse pass: each holds a high tile with all raised tiles connected to
// it. `tile_near` is 0 for tiles that do not matter. Bounds are multiples of 16 points. Marks in `blocks` where heights
// are to be exact.
std::vector<Window> find_windows(const MeshPass& pass, const Mesh& mesh, const RayBase& base, const View& view,
                                 const std::vector<std::uint8_t>& tile_near, const Grid<float>& frame, const WindowOptions& options,
                                 Blocks& blocks);

// The window enlarged on each side by `points`, then outwards to multiples of 16, and limited to the frame of nx by ny
// points.
Window grown(const Window& window, int points, int nx, int ny);

}  // namespace debulk
