#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/cloud/pinhole.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {

// What is known of a pixel after the pass. Every state but `kept` and `removed` is to be resolved.
enum PixelState : std::uint8_t {
  pixel_removed = 0,   // nothing seen, or an outlier
  pixel_kept = 1,      //
  pixel_close = 0x40,  // its distance is known, and too close to the guessed threshold to be decided
  pixel_open = 0x80,   // a point outside the windows might be among its nearest four
};

// Depth of the surface that heights are measured from, along the rays, and millimetres of height for each millimetre of
// depth nearer than that; known at every `step`-th pixel and linear between. `nx` by `ny` values cover the image and one
// step more.
struct RayBase {
  int step = 1, nx = 0, ny = 0;
  std::vector<float> depth, gain;  // NaN: no height here
};

constexpr int tile_width = 16, tile_height = 4;  // pixels

// A tile of pixels: the depths of its points that are certain, and the mean height of those that stay.
struct Tiles {
  int nx = 0, ny = 0;              // of the image
  int pitch = 0;                   // of a row in the arrays: 16 more, empty; a row more, empty
  std::vector<float> near, far;    // +infinity, -infinity: empty
  std::vector<float> mean_height;  // NaN: none
  void resize(int width, int height);
};

struct WindowPass {
  CloudView cloud;
  Pinhole camera;
  double tolerance = pinhole_tolerance;  // px
  double low = 0, high = 0;              // mm; at or below low: kept, above high: removed
  bool certified = true;                 // see PinholeOutliers
  double side_of = 0;                    // mm; of open points it is enough to know on which side of it their distance is; 0: it is not
  const RayBase* base = nullptr;         // none: no heights
  // Out, one per pixel or tile.
  std::uint8_t* states = nullptr;
  float* heights = nullptr;  // NaN where the point was removed
  Tiles* tiles = nullptr;
  Isa isa = best_isa();
};

struct ClosePixel {
  std::uint32_t index;
  float distance;  // mean, mm
};

struct OpenPixel {
  std::uint32_t index;
  float x, y, z;
  float limit;     // squared distance below which there are four; infinity: not known
  float distance;  // mean, on the same side of WindowPass::side_of as the point's own; NaN: not known
};

struct WindowBand {
  double sum = 0, squares = 0;  // of the certain points' mean distances
  long certain = 0, seen = 0;
  long strays = 0;  // points not where the camera should have put them
  std::vector<OpenPixel> open;
  std::vector<ClosePixel> close;
  void clear();
};

constexpr int band_rows = 64;

// Mean distance of every point in the band to the nearest four of the eight pixels round it, and whether these are
// certainly its nearest four. Where they are not (a noisy sheet, a neighbour that was not seen), the 5 by 5 pixels round it
// get a second chance.
//
// Certain: let p be a point whose image lies within t pixels (the tolerance) of its pixel, u = (column - cx) / f, and q a
// point at least n + 1 columns to the right, where the window reaches n: x_q >= U z_q with U = u + (n + 1 - t) / f. Between
// p and the plane x = U z that separates it from q lies the distance (U z_p - x_p) / sqrt(1 + U²) >=
// z_p (n + 1 - 2 t) / (f sqrt(1 + U²)), and |p - q| is not less. With |U| <= |u| + (n + 1) / f the same holds to the left,
// and with v for rows. Where the fourth distance in the window is not above the smaller of both, no point outside the
// window can come before it.
void window_pass(const WindowPass& pass, int band, WindowBand& out);

}  // namespace debulk
