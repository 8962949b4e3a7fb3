#pragma once

#include <cstddef>
#include <vector>

#include "debulk/core/simd.hpp"

namespace debulk {

// A camera's phase map as it was taken, and where each pixel of the rectified image lies in it. If map_x and map_y are
// null, the image is rectified already.
struct PhaseView {
  const float* phase = nullptr;  // rad
  const float* noise = nullptr;  // rad; null: unknown
  int width = 0, height = 0;
  const float* map_x = nullptr;  // column of each pixel of the rectified image, in pixels of this one; map_y: its row
  const float* map_y = nullptr;
  int rectified_width = 0, rectified_height = 0;
  float edge = 0;  // rad; neighbouring phases further apart than this lie on two sides of an edge
};

// A row of the rectified phase map. The phase is interpolated between four pixels, but never across an edge or a gap.
// A gap of a single pixel is bridged: a pixel that alone has no phase, or has one unlike those of both its neighbours in
// the row, is left out where these lie on one surface. What rests on such a pixel is known, but was not measured.
// Behind the last pixel, `row_room` floats can be read; those of the phase are NaN.
constexpr int row_room = 48;
struct RectifiedRow {
  std::vector<float> phase;     // rad; NaN where there is none
  std::vector<float> noise;     // rad; standard deviation before the interpolation along the row
  std::vector<float> fraction;  // position between two columns of the image as it was taken, 0 to 1
  std::vector<int> bridged;     // columns whose nearest pixel was left out, in ascending order
};

void rectify_row(const PhaseView& view, int row, RectifiedRow& out, Isa isa = best_isa());

// Median step of the phase between neighbouring pixels along some rows of the image as it was taken, rad; 0 if no two
// neighbours have a phase.
float median_step(const PhaseView& view);

}  // namespace debulk
