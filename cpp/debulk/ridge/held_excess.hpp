#pragma once

#include "debulk/net/net.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// What the doubly held fibres of a laid net have to spare over their mold (docs/verdicts.md). Inextensible and held at both ends
// by fixed nodes, a fibre keeps its excess in every minimum of the energy, and on fine nets one fold gathers nearly all of it.
struct HeldExcess {
  int fibres = 0;        // held at both ends; with none the rest is 0
  double largest = 0.0;  // mm, of the fibre with the most to spare; 0 when none has any
  // mm, upper bound of a bridge: how far a string pulled taut over the mold from end to end of a fibre that is shorter than its
  // mold would hang above it. 0 where no fibre is too short, or the mold under those is nowhere hollow.
  double bridge_bound = 0.0;
  int segments = 0;         // of the fibre with the most to spare
  double noise_gain = 0.0;  // standard deviation of its length over that of independent noise in the heights of its nodes
};

// A whole fibre counts, also where its rim passes fixed nodes on the way: those sit on the mold, and a fold that gathers
// there would pull the ply over them.
HeldExcess held_excess(const Net& laid, const Surface& mold);

}  // namespace debulk
