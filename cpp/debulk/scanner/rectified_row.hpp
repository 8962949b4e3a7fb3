#pragma once

#include <cstddef>
#include <vector>

#include "debulk/core/simd.hpp"

namespace debulk {

// A camera's phase map as it was taken, and where each pixel of the rectified image lies in it. Null maps: it is rectified.
struct PhaseView {
  const float* phase = nullptr;  // rad
  const float* noise = nullptr;  // rad; null: not known
  int width = 0, height = 0;
  const float* map_x = nullptr;  // of each pixel of the rectified image, in pixels of this one
  const float* map_y = nullptr;
  int rectified_width = 0, rectified_height = 0;
  float edge = 0;  // rad: neighbouring phases further apart than this lie on two sides of an edge
};

// A row of the rectified phase map. The phase is interpolated between four pixels, never across an edge or a gap.
struct RectifiedRow {
  std::vector<float> phase;     // NaN: nothing
  std::vector<float> noise;     // rad, of the interpolated phase but for the weights along the row
  std::vector<float> fraction;  // how far between two columns of the image as it was taken
};

void rectify_row(const PhaseView& view, int row, RectifiedRow& out, Isa isa = best_isa());

// Median step of the phase between neighbouring pixels of a row as it was taken, rad; 0 where there is none.
float median_step(const PhaseView& view);

}  // namespace debulk
