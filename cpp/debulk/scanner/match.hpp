#pragma once

#include <vector>

#include "debulk/scanner/rectified_row.hpp"

namespace debulk {

struct MatchCounts {
  long seen = 0;       // pixels of the left image that have a phase
  long matched = 0;    // pixels with a sure match
  long unmatched = 0;  // pixels whose phase is nowhere in the right row: hidden from the right camera, or not lit there
  long ambiguous = 0;  // pixels whose phase occurs at two places of a row, or for which the left-right check failed
  long behind = 0;     // pixels whose match was dropped because its depth is not allowed; not counted in `matched`
  MatchCounts& operator+=(const MatchCounts& other);
};

// Where phases occur in a row. Along one surface they rise or fall from pixel to pixel, but for noise: then a phase is
// found near the place where it is expected, and the order of all others shows that it occurs nowhere else. Only for
// phases of which this is not so are the row's segments between neighbouring pixels sorted into bins.
// Pixels are counted in floats, because vectors gather floats.
struct PhaseIndex {
  const RectifiedRow* row = nullptr;
  int width = 0;
  float edge = 0;                // the greatest step of the phase that is not an edge, rad
  float step = 0, per_step = 0;  // a usual step between neighbours, rad, and its inverse
  float low = 0, high = 0;       // range of the row's phases, rad
  float turn = 1;                // 1 or -1: the phases times this rise along the row
  // Behind row_room others: of each pixel, the greatest of the turned phases up to it, and the least from it on.
  std::vector<float> below, above;
  int bins = -1;                   // 0: no phase occurs; -1: not sorted yet
  float per_rad = 0;               // the bin of a phase is (phase - low) * per_rad
  std::vector<float> first, last;  // of each bin, the segments that reach into it and those between them
};

// Matches two rectified rows by their phase. Reuses its memory from row to row.
class RowMatcher {
 public:
  // disparity[i] is the column in the left row minus the column in the right row, in px, NaN where there is no sure
  // match; sigma[i] is its standard deviation due to the noise of the phases, px. Both have room for whole groups of
  // sixteen pixels. A step is a usual one of the phase between neighbours, an edge the greatest that is none (rad).
  MatchCounts match(const RectifiedRow& left, int left_width, float left_step, float left_edge, const RectifiedRow& right, int right_width,
                    float right_step, float right_edge, float* disparity, float* sigma, Isa isa = best_isa());

 private:
  PhaseIndex left_, right_;
};

}  // namespace debulk
