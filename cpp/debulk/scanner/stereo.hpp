#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/scanner/match.hpp"
#include "debulk/scanner/rectified_row.hpp"

namespace debulk {

// Two rectified pinhole cameras with the same focal length and matching rows. Pixel (row i, column j) of the left one
// looks along ((j - cx) / f, (i - cy) / f, 1); the right one stands `baseline` to its right.
struct StereoGeometry {
  double focal = 1;                  // px
  double left_cx = 0, right_cx = 0;  // px
  double cy = 0;                     // px
  double baseline = 1;               // mm
  double nearest = 0, furthest = 0;  // mm; points at depths outside are refused
};

// Maps with one value per pixel of the left rectified image. A map whose pointer is null is not computed.
struct StereoMaps {
  float* disparity = nullptr;    // px, left column minus right column; NaN where there is no match
  float* sigma = nullptr;        // px
  float* points = nullptr;       // three floats per pixel, mm, in the frame of the left rectified camera
  float* uncertainty = nullptr;  // standard deviation of the point along its ray, mm
};

struct StereoOptions {
  double edge_ratio = 3;  // neighbouring phases further apart than this many of the image's median steps lie on two surfaces
  int threads = 0;
  Isa isa = best_isa();
};

// Matches the images row by row and, if a geometry is given, triangulates. The edges of the views are set from
// edge_ratio.
MatchCounts match_rows(PhaseView left, PhaseView right, const StereoGeometry* geometry, const StereoOptions& options,
                       const StereoMaps& maps, const Stop& stop);

}  // namespace debulk
