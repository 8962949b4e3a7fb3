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
  double thickness_mm = kNominalThicknessMm;  // of the ply, because the scan sees its upper side
  double mold_tol_mm = kNominalMoldTolMm;     // a lower side this near lies on the mold; raised to 3 sigma of the noise
  double smooth_mm = 8.0;                     // window of the smoothing beforehand; 0: no smoothing
  std::optional<double> noise_mm;             // sigma of the heights' noise; empty: it is estimated
  void check() const;
};

// Where a pocket's ply comes down to the mold: the contour height - thickness = mold_tol round the pocket
// (docs/model.md, section 1.5). Pockets between which the ply does not come down share one foot.
struct Foot {
  std::int32_t label = 0;  // of its points in FootMap::labels: the smallest id of the pockets that share it
  Polygon outline;         // counter-clockwise, mold XY, mm
  double area = 0;         // mm2
  Box box;
  bool closed = false;            // nowhere cut by unknown heights or the border of the grid (the ply's edge is allowed)
  bool touches_ply_edge = false;  // the foot runs along the ply's outline
  bool parted = false;            // somewhere its outline is not at the mold but next to a hill below half the cut
};

struct FootMap {
  std::vector<Foot> feet;     // one per pocket, in the order of their ids
  Grid<std::int32_t> labels;  // Foot::label of the foot to which a point belongs; 0: none
  Grid<float> heights;        // smoothed, above the reference, mm
  double noise_mm = 0;        // sigma of the heights before smoothing
  double mold_tol_mm = 0;     // as used
  double hill_mm = 0;         // least height of hills outside pockets: half the cut, or the cut if feet begin higher
  FootOptions options;
};

// Every point above the contour's height belongs to the pocket from which it is reached downhill. A flood runs down
// from all pockets, and from everything else that is at least hill_mm high, at once and the highest point first.
// Because of noise, it may rise again by mold_tol above the lowest point on its way. Floods that meet become one foot:
// a fibre over the saddle between two pockets is held on neither side of the saddle, and its excess length can gather
// in one ridge. Throws InputError and Stopped.
FootMap find_feet(const Segmentation& segmentation, const FootOptions& options, int threads = 0, const Stop& stop = Stop());
// The same; `out` is overwritten, and the memory of its grids reused.
void find_feet(const Segmentation& segmentation, const FootOptions& options, FootMap& out, int threads, const Stop& stop);

}  // namespace debulk
