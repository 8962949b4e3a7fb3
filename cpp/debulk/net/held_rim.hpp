#pragma once

#include "debulk/net/fibre_net.hpp"

namespace debulk {

// The net as most friction would have it at the ply's edge: a free node on the mold, past which a fibre goes on for more than a
// spacing, is fixed, and each other one grips over that way, where it is longer than the nearest. Only where the ply itself ends with
// the net does it slip. The net as laid is the other end of the range (docs/model.md, section 3).
PocketNet with_rim_held(const PocketNet& laid);

}  // namespace debulk
