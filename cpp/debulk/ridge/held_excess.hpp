#pragma once

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// The excess length over the mold of the fibres of a laid net that are held at both ends (docs/verdicts.md). Such a
// fibre is inextensible and ends at fixed nodes, so it keeps its excess in every minimum of the energy; on fine nets
// one fold gathers nearly all of it.
struct HeldExcess {
  int fibres = 0;        // number of fibres held at both ends; if it is 0, the other members are 0
  double largest = 0.0;  // mm, of the fibre with the largest excess; 0 if none has any
};

// Each fibre counts as a whole, even if it passes fixed nodes of the rim on the way: these lie on the mold, and a fold
// that gathers the excess would pull the ply over them.
HeldExcess held_excess(const Net& laid, const Surface& mold);

}  // namespace debulk
