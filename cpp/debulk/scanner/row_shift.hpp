#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/stop.hpp"

namespace debulk {

// The light of the fringes in a camera's images, and where the pixels of its rectified image lie in it.
struct SeenTexture {
  const float* modulation = nullptr;  // NaN where every exposure is saturated
  const std::uint8_t* exposure = nullptr;
  std::vector<float> brightness;  // of each exposure
  int width = 0, height = 0;
  const float *map_x = nullptr, *map_y = nullptr;  // of the rectified image
  int rectified_width = 0;
};

// Where a point of the left image lies in its row of the right one.
struct RowMatches {
  const float* points = nullptr;  // three floats per pixel, mm
  int width = 0, height = 0;      // of the left rectified image; the right one is as high
  float depth_px = 0;             // mm px: the focal length times the baseline
  float shift = 0;                // px: the disparity of a point at infinity, times -1
};

struct PatchPlace {
  int column = 0, row = 0;
};

struct RowShift {
  bool textured = false;   // whether enough points with enough texture were there
  double correlation = 0;  // of the patch with the most similar one; 0 if that is not between others
  double rows = 0;         // px from the point's row in the left image down to its row in the right one
};

// Half the size of a patch, and how far up and down it is looked for, both in steps.
constexpr int patch_half = 12, row_reach = 6;

// In a patch round each place, compares the texture of the left image with that of the right one at the matched places and
// in the rows above and below. A patch has every step-th pixel. The texture is the logarithm of the modulation, without
// its mean and slopes, so that neither the exposure nor the slope of the light matters.
std::vector<RowShift> row_shifts(const std::vector<PatchPlace>& places, int step, const RowMatches& matches, const SeenTexture& left,
                                 const SeenTexture& right, int threads, const Stop& stop);

}  // namespace debulk
