#pragma once

#include <vector>

#include "debulk/scanner/rectified_row.hpp"

namespace debulk {

struct MatchCounts {
  long seen = 0;       // pixels of the left image that have a phase
  long matched = 0;    //
  long unmatched = 0;  // no phase of the right row is that one: hidden from the right camera, or not lit there
  long ambiguous = 0;  // two places of a row have that phase, or the left-right check failed
  long behind = 0;     // matched, at a disparity that no point in front of both cameras has
  MatchCounts& operator+=(const MatchCounts& other);
};

// Where each phase occurs in a row: the segments between neighbouring pixels, found by the phase.
class PhaseIndex {
 public:
  // `step`: a usual step between neighbours; `edge`: the greatest that is no edge (rad).
  void build(const std::vector<float>& phase, int width, float step, float edge);
  // The place between pixels at which the row has this phase; NaN: nowhere, negative: in two places far apart.
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

// Matches two rectified rows by their phase. Keeps its memory from row to row.
class RowMatcher {
 public:
  // disparity[i]: column in the left row minus column in the right one, NaN where there is no sure match; sigma: its standard
  // deviation from the phases' noise, px.
  MatchCounts match(const RectifiedRow& left, int left_width, float left_step, float left_edge, const RectifiedRow& right, int right_width,
                    float right_step, float right_edge, float* disparity, float* sigma);

 private:
  PhaseIndex left_, right_;
};

}  // namespace debulk
