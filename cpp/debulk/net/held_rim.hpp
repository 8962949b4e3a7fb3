#pragma once

#include "debulk/net/fibre_net.hpp"

namespace debulk {

// Returns the net with the most friction that is possible at the ply's edge. A free node on the mold is fixed if a
// fibre continues past it for more than a spacing. Any other free node grips over the distance along that fibre to the
// edge, where this is longer than its nearest distance to the edge. So the ply slips only where it ends together with
// the net. The net as laid is the other end of the range (docs/model.md, section 3).
PocketNet with_rim_held(const PocketNet& laid);

}  // namespace debulk
