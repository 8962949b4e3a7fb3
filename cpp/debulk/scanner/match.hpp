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

// Finds where a phase occurs in a row. The segments between neighbouring pixels are sorted into bins of phase.
class PhaseIndex {
 public:
  // `step`: a usual step of the phase between neighbours; `edge`: the greatest step that is not an edge (both in rad).
  void build(const std::vector<float>& phase, int width, float step, float edge);
  // The place, in pixels, at which the row has this phase; NaN if there is none, negative if there are two far apart.
  double find(float phase) const;

 private:
  struct Place {
    int first, last;
  };
  const float* phase_ = nullptr;
  float low_ = 0, per_rad_ = 0, edge_ = 0;
  int count_ = 0;
  std::vector<Place> places_;
};

// Matches two rectified rows by their phase. Reuses its memory from row to row.
class RowMatcher {
 public:
  // disparity[i] is the column in the left row minus the column in the right row, in px, NaN where there is no sure
  // match; sigma[i] is its standard deviation due to the noise of the phases, px.
  MatchCounts match(const RectifiedRow& left, int left_width, float left_step, float left_edge, const RectifiedRow& right, int right_width,
                    float right_step, float right_edge, float* disparity, float* sigma);

 private:
  PhaseIndex left_, right_;
};

}  // namespace debulk
