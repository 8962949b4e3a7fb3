#pragma once

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// How far apart the points of a cloud are, in mm. For an organised cloud, this is the median distance of neighbouring
// pixels (along rows and columns alike) projected on the XY plane, from an even sample of about a million pixels. For
// an unorganised cloud, it is the median over the points of the mean distance to the four nearest neighbours, which is
// the pitch on a square lattice and about 0.8/sqrt(density) on a random cloud. 0 if no two neighbours were seen.
// Throws Stopped.
double median_pitch(const CloudView& cloud, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
