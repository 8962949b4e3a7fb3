#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/net/fibre_net.hpp"
#include "debulk/pocket/patch.hpp"

namespace debulk {

struct LayPocketOptions {
  PatchMode mode = PatchMode::foot;
  FibreNetOptions net;  // mold_tol is not used (the foot contours' applies); in mode paper, paths is always vertical_plane

  void check() const { net.check(); }
};

// Lays one pocket's net from its segmentation: the patch (patch_excess), the smooth surface through it, and the net on
// that surface (fibre_net), from the pocket's centroid or, if that is near the rim or outside, from the deepest point
// inside. The RMS counts nodes inside the pocket's outline at the cut. Throws InputError and Stopped.
PocketNet lay_pocket(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const FibreAngles& angles,
                     const Polygon& ply_outline, const LayPocketOptions& options, const Stop& stop = Stop());

}  // namespace debulk
