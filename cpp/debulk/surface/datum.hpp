#pragma once

#include "debulk/surface/reference.hpp"

namespace debulk {

// The datum of a ply of this thickness, mm: the surface above which the upper side of a ply that lies on the mold is one
// thickness high along z everywhere (docs/model.md, section 1). The ply keeps its thickness along the mold's normal, so
// the datum is the parallel surface of the mold at that distance, less the thickness: on a slope it lies above the mold.
// Returns the mold itself where the two differ by less than 1 um everywhere.
Reference datum(const Reference& mold, double thickness, int threads = 0);

}  // namespace debulk
