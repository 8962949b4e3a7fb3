#pragma once

#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

struct RiderOptions {
  double stands_out_mm = 0.3;  // above the filtered heights; the filters lower a bump that stands out by less only slightly
  double noise = 6.0;          // least height above the filtered heights, in standard deviations of the points' noise
  double wide_mm = 5.0;        // least width; a narrower bump covers too few pixels
  double top_mm = 1.5;         // radius of the top round a bump's highest point, mm; the same number of pitches if that is more
  double out_share = 0.6;      // least share of the points of the top that stand out
  double sunk_share = 0.05;    // largest share of the points near it that lie as deep below: in a highlight, half of them do
  double ring_mm = 8.0;        // distance from the top beyond which the bump has no effect; the ply is read up to twice as far
  double highest_mm = 25.0;    // a point that stands out by more belongs to another object
  int fewest = 5;              // least number of points near the top that stand out: fewer are flying pixels
};

// A bump that rides on a pocket.
struct Rider {
  Eigen::Vector2d top = Eigen::Vector2d::Zero();  // mold XY, mm
  double height = 0;                              // above the ply without the bump, mm
  double wide = 0;                                // width at its foot, mm
};

// Finds bumps on a pocket that are so narrow that the filters take them for noise. NarrowBumps finds such bumps on even
// ground only, and a pocket is not even. But the pocket's heights after all filters show how the ply lies without the
// bump: there is a bump where adjacent points stand above these heights and hardly any lie below. points: the scan
// before any filter, mold frame, pitch_mm apart. The highest bump comes first. Throws Stopped.
std::vector<Rider> riders(const CloudView& points, double pitch_mm, const FootMap& feet, const Foot& foot, const Surface& reference,
                          const RiderOptions& options = {}, const Stop& stop = Stop());

}  // namespace debulk
