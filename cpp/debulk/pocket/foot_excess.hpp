#pragma once

#include <cmath>
#include <cstdint>

#include "debulk/core/grid.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/patch.hpp"
#include "debulk/pocket/ply_mask.hpp"
#include "debulk/pocket/segment.hpp"

namespace debulk {

// The part of the height map round the perimeter, and where its points lie in the map.
struct PatchWindow {
  int i0, j0, nx, ny;
  const Segmentation& segmentation;
  const FootMap& feet;
  PlyMask ply;  // on the patch's points, beyond the map too; everywhere if the pocket does not touch the ply's edge

  bool known(int i, int j) const {
    return feet.heights.contains(i + i0, j + j0) && !std::isnan(feet.heights.at(i + i0, j + j0)) && segmentation.ply.on_ply(i + i0, j + j0);
  }
  bool off_ply(int i, int j) const { return !ply.on_ply(i, j); }
  // Whether the ply's edge runs beside the point, so that its height may be partly the mold's.
  bool at_edge(int i, int j) const {
    const bool amid = !ply.known() || i == 0 || j == 0 || i == nx - 1 || j == ny - 1;
    return !amid && (off_ply(i - 1, j) || off_ply(i + 1, j) || off_ply(i, j - 1) || off_ply(i, j + 1));
  }
  double height(int i, int j) const { return feet.heights.at(i + i0, j + j0); }
};

// Adds max(ply - t, F) - F to the surface at the points `within` the pocket's region, and its fade to 0 outside (see
// make_patch).
void add_foot_excess(const PatchWindow& window, const Grid<std::uint8_t>& within, const PatchOptions& options, Grid<double>& surface);

}  // namespace debulk
