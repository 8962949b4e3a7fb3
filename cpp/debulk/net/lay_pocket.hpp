#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/net/fibre_net.hpp"
#include "debulk/pocket/patch.hpp"

namespace debulk {

// One pocket's net from its segmentation: the patch (make_patch), the smooth surface through it, and the net on that
// (fibre_net), from the pocket's centroid; the RMS counts inside the pocket's outline at the cut. Throws Stopped.
PocketNet lay_pocket(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const PatchOptions& patch,
                     const FibreAngles& angles, const Polygon& ply_outline, const FibreNetOptions& net, const Stop& stop = Stop());

}  // namespace debulk
