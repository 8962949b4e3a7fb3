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
  double top = 0;  // mm, about the highest thing in it

  long size() const { return static_cast<long>(i1 - i0) * (j1 - j0); }
  bool overlaps(const Window& o) const { return i0 < o.i1 && o.i0 < i1 && j0 < o.j1 && o.j0 < j1; }
  bool operator==(const Window& o) const { return i0 == o.i0 && j0 == o.j0 && i1 == o.i1 && j1 == o.j1; }
};

// Windows that overlap become the one that holds both, until none does; in the order of rows and columns.
std::vector<Window> merged(std::vector<Window> windows);

// Which blocks of 16 by 16 points of a grid are to be exact.
struct Blocks {
  static constexpr int side = 16;

  explicit Blocks(const Grid<float>& frame = {});
  bool wanted(int i, int j) const { return top.at(i, j) >= 0; }  // a block
  void add(const Window& points, double height);                 // every block that these touch
  // Rectangles that cover the window's wanted blocks, none twice: few and large ones, for the image part of each reaches
  // `margin` points beyond it, but not so many blocks more that these would cost less.
  std::vector<Window> rectangles(const Window& window, double margin) const;

  int nx = 0, ny = 0;  // points of the frame
  Grid<float> top;     // mm, about the highest thing in the block; negative: not wanted
};

struct WindowOptions {
  double low_mm = 0.4;     // a tile whose mean height is above this stands up
  double margin_mm = 4.5;  // of exact heights round what stands up
};

// Windows round everything in the coarse pass that is high: each such tile with all tiles that stand up and are connected to it.
// `tile_near` is 0 for tiles that do not matter. Bounds are multiples of 16 points. Adds to `blocks` what is to be exact.
std::vector<Window> find_windows(const MeshPass& pass, const Mesh& mesh, const RayBase& base, const View& view,
                                 const std::vector<std::uint8_t>& tile_near, const Grid<float>& frame, const WindowOptions& options,
                                 Blocks& blocks);

// Bounds moved outwards by so many points, to multiples of 16, inside the frame.
Window grown(const Window& window, int points, int nx, int ny);

}  // namespace debulk
