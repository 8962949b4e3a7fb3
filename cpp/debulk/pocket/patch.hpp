#pragma once

#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/polygon.hpp"
#include "debulk/pocket/segment.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

enum class PatchMode : std::uint8_t {
  foot,   // net surface max(ply - t, F) out to where it meets the mold: no step at the perimeter
  paper,  // the ply inside the cut outline, F outside: a step of up to the cut height there
};

struct PatchOptions {
  PatchMode mode = PatchMode::foot;
  double margin_mm = 30.0;  // of the window round the outline: at least the offset of the net's boundary
  double fade_mm = 4.0;     // width outside the foot over which the remaining height falls to F; 0: at once
  void check() const;
};

// The surface on which one pocket's net is laid. Its grid is aligned with the height map's and may reach beyond it,
// where the surface is F.
struct Patch {
  int id = 0;
  PatchMode mode = PatchMode::foot;
  Polygon outline;      // the perimeter: foot contour, or the cut's outline in mode paper
  double area = 0;      // inside the outline, mm2
  bool closed = false;  // see Foot
  bool touches_ply_edge = false;
  bool parted = false;        // see Foot
  Grid<double> surface;       // mm, mold frame; finite everywhere
  Grid<double> reference;     // F at the same points
  Grid<std::uint8_t> within;  // 1 at the points of the pocket's own region
};

// F is sampled from `reference`, also outside its data (where a Surface is continued). In mode foot, the surface still
// has some height at the border of the pocket's own region (mold_tol on the mold, more at a saddle to a neighbour),
// which fades to F over fade_mm. Past the ply's edge, the edge's height fades over the margin, so that a net can be
// laid up to the edge. Throws InputError.
Patch make_patch(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const PatchOptions& options);

// Only the height of the patch's surface above F, on the smallest grid that holds it, with `border` points of 0 round
// it. If a pocket touches the ply's edge, its height reaches as far as the margin.
Grid<double> patch_excess(const Segmentation& segmentation, const FootMap& feet, int id, const PatchOptions& options, int border);

}  // namespace debulk
