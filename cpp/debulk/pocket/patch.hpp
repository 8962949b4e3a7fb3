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
  double margin_mm = 30.0;  // of the window, round the outline: at least the offset of the net's boundary
  double fade_mm = 4.0;     // outside the foot, over which what still stands up goes down to F; 0: at once
  void check() const;
};

// The surface on which one pocket's net is laid. Its grid is aligned with the height map's and may reach beyond it, where F
// goes on.
struct Patch {
  int id = 0;
  PatchMode mode = PatchMode::foot;
  Polygon outline;      // the perimeter: foot contour, or the cut's outline in mode paper
  double area = 0;      // inside it, mm2
  bool closed = false;  // see Foot
  bool touches_ply_edge = false;
  bool parted = false;        // see Foot
  Grid<double> surface;       // mm, mold frame; finite everywhere
  Grid<double> reference;     // F at the same points
  Grid<std::uint8_t> within;  // 1 at the points of the pocket's own region
};

// F is sampled from `reference`, also outside its data (a Surface goes on there). In mode foot the surface leaves the
// pocket's own region with what is left there (mold_tol on the mold, more at a saddle to a neighbour), which fades to F over
// fade_mm; past the ply's edge the edge's height fades over the margin, so that a net can be laid up to the edge.
Patch make_patch(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const PatchOptions& options);

// Only what the patch's surface has above F: on the smallest grid that holds it, and `border` points of 0 round that. A pocket that
// touches the ply's edge stands up as far as the margin reaches.
Grid<double> patch_excess(const Segmentation& segmentation, const FootMap& feet, int id, const PatchOptions& options, int border);

}  // namespace debulk
