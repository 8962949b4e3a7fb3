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

// A row whose segments between neighbouring pixels are sorted into bins of phase, to find where a phase occurs in it.
// Pixels are counted in floats, because vectors gather floats.
struct PhaseIndex {
  const RectifiedRow* row = nullptr;
  int width = 0;
  float edge = 0;                  // the greatest step of the phase that is not an edge, rad
  float low = 0, per_rad = 0;      // the bin of a phase is (phase - low) * per_rad
  int bins = 0;                    // 0: no phase occurs
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
