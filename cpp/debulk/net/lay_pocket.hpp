#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/net/fibre_net.hpp"
#include "debulk/pocket/patch.hpp"

namespace debulk {

struct LayPocketOptions {
  PatchMode mode = PatchMode::foot;
  FibreNetOptions net;  // its mold_tol follows from the foot contours' and is not used; in mode paper its paths are vertical planes

  void check() const { net.check(); }
};

// One pocket's net from its segmentation: the patch (patch_excess), the smooth surface through it, and the net on that
// (fibre_net), from the pocket's centroid; the RMS counts inside the pocket's outline at the cut. Throws Stopped.
PocketNet lay_pocket(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const FibreAngles& angles,
                     const Polygon& ply_outline, const LayPocketOptions& options, const Stop& stop = Stop());

}  // namespace debulk
