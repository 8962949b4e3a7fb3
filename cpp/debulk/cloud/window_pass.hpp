#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/cloud/pinhole.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {

// What is known of a pixel after the pass. Pixels in other states than `removed` and `kept` are still to be resolved.
enum PixelState : std::uint8_t {
  pixel_removed = 0,   // nothing was seen, or the point is an outlier
  pixel_kept = 1,      // the point is not an outlier
  pixel_close = 0x40,  // its mean distance is known, but too close to the guessed threshold to be decided
  pixel_open = 0x80,   // a point outside the windows might be among its nearest four
};

// The surface from which heights are measured, along the rays: its depth, and `gain`, the millimetres of height per
// millimetre of depth beyond it (negative for a camera that looks down). Both are known at every `step`-th pixel and
// linear between. `nx` by `ny` values cover the image and one step more.
struct RayBase {
  int step = 1, nx = 0, ny = 0;
  std::vector<float> depth, gain;  // NaN: no height here
};

constexpr int tile_width = 16, tile_height = 4;  // pixels

// Tiles of pixels: the depths of the certain points in each, and the mean height of those that are kept.
struct Tiles {
  int nx = 0, ny = 0;              // tiles in the image
  int pitch = 0;                   // tiles per row of the arrays; its last 16, and a last row, are empty
  std::vector<float> near, far;    // least and greatest depth, mm; +infinity, -infinity: empty
  std::vector<float> mean_height;  // mm; NaN: no height
  void resize(int width, int height);
};

struct WindowPass {
  CloudView cloud;
  Pinhole camera;
  double tolerance = pinhole_tolerance;  // px
  double low = 0, high = 0;              // mm; a mean distance at or below low: kept, above high: removed
  bool certified = true;                 // see PinholeOutliers
  const RayBase* base = nullptr;         // null: no heights
  // Output, one value per pixel or tile.
  std::uint8_t* states = nullptr;
  float* heights = nullptr;  // mm; NaN where the point was removed
  Tiles* tiles = nullptr;
  Isa isa = best_isa();
};

struct ClosePixel {
  std::uint32_t index;
  float distance;  // mean distance, mm
};

struct OpenPixel {
  std::uint32_t index;
  float x, y, z;
  float limit;  // squared distance within which there are four points; infinity: not known
};

struct WindowBand {
  double sum = 0, squares = 0;  // of the certain points' mean distances
  long certain = 0, seen = 0;
  long strays = 0;  // points that are not where the camera should have put them
  std::vector<OpenPixel> open;
  std::vector<ClosePixel> close;
  void clear();
};

constexpr int band_rows = 64;

// Computes the mean distance of every point in the band to the nearest four of the eight pixels round it, and whether
// these are certainly its nearest four. If they are not (on a noisy sheet, or if a neighbour was not seen), the 5 by 5
// pixels round the point are tried as well.
//
// When they are certain: let p be a point whose image lies within t pixels (the tolerance) of its pixel,
// u = (column - cx) / f, and q a point at least n + 1 columns to the right, where the window reaches n columns. Then
// x_q >= U z_q with U = u + (n + 1 - t) / f. The distance between p and the plane x = U z, which separates it from q,
// is (U z_p - x_p) / sqrt(1 + U²) >= z_p (n + 1 - 2 t) / (f sqrt(1 + U²)), and |p - q| is not less. With
// |U| <= |u| + (n + 1) / f the same holds to the left, and with v for rows. If the fourth distance in the window is not
// above the smaller of both bounds, no point outside the window can be nearer.
void window_pass(const WindowPass& pass, int band, WindowBand& out);

}  // namespace debulk
