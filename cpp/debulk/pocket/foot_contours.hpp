#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/nominal_ply.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/polygon.hpp"
#include "debulk/pocket/segment.hpp"

namespace debulk {

struct FootOptions {
  double thickness_mm = kNominalThicknessMm;  // of the ply: the scan sees its upper side
  double mold_tol_mm = kNominalMoldTolMm;     // the ply lies on the mold where its lower side is this near; raised to 3 sigma of the noise
  double smooth_mm = 8.0;                     // window of the smoothing before; 0: none
  std::optional<double> noise_mm;             // sigma of the heights' noise; none: estimated
  void check() const;
};

// Where a pocket's ply comes down to the mold: the contour height - thickness = mold_tol round it (docs/model.md, section 1.5). Pockets
// between which the ply does not come down share one foot.
struct Foot {
  std::int32_t label = 0;  // of its points in FootMap::labels: the smallest id of the pockets that share it
  Polygon outline;         // counter-clockwise, mold XY, mm
  double area = 0;         // mm2
  Box box;
  bool closed = false;            // nowhere cut by unknown heights or the border of the grid (the ply's edge is allowed)
  bool touches_ply_edge = false;  // runs along the ply's outline
  bool parted = false;            // somewhere it is the line that parts it from a hill below half the cut, not the mold
};

struct FootMap {
  std::vector<Foot> feet;     // one per pocket, in the order of their ids
  Grid<std::int32_t> labels;  // Foot::label of the foot to which a point belongs, 0: none
  Grid<float> heights;        // smoothed, above the reference
  double noise_mm = 0;        // sigma of the heights before smoothing
  double mold_tol_mm = 0;     // as used
  double hill_mm = 0;         // height above which what is no pocket stands up: half the cut, or the cut where feet begin above that
  FootOptions options;
};

// Every point that stands up belongs to the pocket it drains up to: a flood downhill from all pockets, and from all else that stands
// half the cut's height, at once, the highest point first. It may rise again by mold_tol over the lowest point of its way, for noise.
// Floods that meet are one foot: a fibre over the saddle between two pockets is held at neither of their sides of it, and its excess can
// gather in one ridge. Throws Stopped.
FootMap find_feet(const Segmentation& segmentation, const FootOptions& options, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
