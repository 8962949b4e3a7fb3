#pragma once

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// How far apart the points of a cloud are, in mm. For an organised cloud, this is the median distance of neighbouring
// pixels (along rows and columns alike) projected on the XY plane, from an even sample of about a million pixels. For
// an unorganised cloud, it is the median over the points of the mean distance to the four nearest neighbours, which is
// the pitch on a square lattice and about 0.8/sqrt(density) on a random cloud; where that leaves gaps, as between the
// lines of a line scanner, it is the widest pitch. 0 if no two neighbours were seen. Throws Stopped.
double median_pitch(const CloudView& cloud, int threads = 0, const Stop& stop = Stop());

// How far apart the points of a cloud are in the direction in which they are farthest apart, in mm: at least `pitch`.
// In an organised cloud it is the larger of the median distances, in space, along rows and along columns, to the next
// pixel that was seen. In an unorganised one it is the side of squares in XY of which nearly none is empty between
// others that are not, or `pitch` if squares half as wide again hold about as many points as random places give them.
double widest_pitch(const CloudView& cloud, double pitch, const Stop& stop = Stop());

}  // namespace debulk
