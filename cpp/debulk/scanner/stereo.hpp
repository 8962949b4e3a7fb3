#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/scanner/match.hpp"
#include "debulk/scanner/rectified_row.hpp"

namespace debulk {

// Two rectified pinholes of one focal length whose rows agree: pixel (row i, column j) of the left one looks along
// ((j - cx) / f, (i - cy) / f, 1), the right one stands `baseline` to its right.
struct StereoGeometry {
  double focal = 1;                  // px
  double left_cx = 0, right_cx = 0;  // px
  double cy = 0;                     // px
  double baseline = 1;               // mm
  double nearest = 0, furthest = 0;  // mm: depths outside are refused
};

// A value for each pixel of the left rectified image; a null pointer is not wanted.
struct StereoMaps {
  float* disparity = nullptr;    // px, left column minus right column; NaN: none
  float* sigma = nullptr;        // px
  float* points = nullptr;       // three each, mm, in the frame of the left rectified camera
  float* uncertainty = nullptr;  // standard deviation along the ray, mm
};

struct StereoOptions {
  double edge_ratio = 3;  // neighbouring phases further apart than this many of the image's median steps lie on two surfaces
  int threads = 0;
  Isa isa = best_isa();
};

// Matches row by row and, where a geometry is given, triangulates. Sets the views' edges.
MatchCounts match_rows(PhaseView left, PhaseView right, const StereoGeometry* geometry, const StereoOptions& options,
                       const StereoMaps& maps, const Stop& stop);

}  // namespace debulk
