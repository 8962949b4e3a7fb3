#pragma once

#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

struct RiderOptions {
  double stands_out_mm = 0.3;  // above the filtered heights; a bump that stands out by less has hardly lost anything
  double noise = 6.0;          // times the noise of the points, at least
  double wide_mm = 5.0;        // what is narrower covers too few pixels
  double top_mm = 1.5;         // from a bump's highest point, or so many times the pitch
  double out_share = 0.6;      // of the points so near the top, that stand out
  double sunk_share = 0.05;    // of those near it, that may lie as deep below: in a highlight, half of them do
  double ring_mm = 8.0;        // round its top, beyond which the ply is as it is without the bump; up to twice so far that is read
  double highest_mm = 25.0;    // what stands out by more is something else
  int fewest = 5;              // points that stand out side by side: fewer are flying pixels
};

// A bump that rides on a pocket.
struct Rider {
  Eigen::Vector2d top = Eigen::Vector2d::Zero();  // mold XY, mm
  double height = 0;                              // above the ply without it, mm
  double wide = 0;                                // at its foot, mm
};

// Bumps that are so narrow that the filters take them for noise. What stands on even ground NarrowBumps finds; a pocket is none. But its
// heights after all filters tell how the ply lies without such a bump: where points next to each other stand above them, with hardly any
// below, there is one. points: of the scan before any filter, mold frame, pitch_mm apart. Highest first. Throws Stopped.
std::vector<Rider> riders(const CloudView& points, double pitch_mm, const FootMap& feet, const Foot& foot, const Surface& reference,
                          const RiderOptions& options = {}, const Stop& stop = Stop());

}  // namespace debulk
