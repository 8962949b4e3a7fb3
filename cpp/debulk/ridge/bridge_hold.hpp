#pragma once

#include <array>
#include <vector>

#include "debulk/net/fibre_net.hpp"
#include "debulk/ridge/fibre_section.hpp"

namespace debulk {

// The tensions in a ply that bridges a hollow, and the friction that can hold it. The model pins the rim, so that a
// fibre too short for its mold by a few um stands taut over it. On a real part only the friction between ply and mold
// holds the fibre, over the distance d from the pocket to the ply's edge: mu P d per unit of width. A fibre that pulls
// harder slips, and the ply is drawn in (docs/model.md, section 5).
struct BridgeHold {
  std::vector<std::array<double, 4>> tension;  // N/mm, of the segment from each node to each neighbour; 0 if there is none
  std::vector<std::array<double, 2>> most;     // N/mm, largest tension that friction holds along each of a node's two fibres
};

// tensions_n: the tension of each of segments(laid.net.neighbours), N, pull positive. The result is empty if the
// tensions or the ply's edge are not known.
BridgeHold bridge_hold(const PocketNet& laid, const std::vector<double>& tensions_n, double friction, double pressure_mpa);

// The pull of a taut section, and whether it slips.
struct Pull {
  double tension = 0.0;  // N/mm, mean over its segments
  double most = 0.0;     // N/mm, largest tension that friction holds
  // True if the section slips, and far enough to lie down: at the tension that friction can hold, and under the same
  // load, the ply would turn at least as much as the mold below it. A ply that slips and still spans the hollow is a
  // bridge.
  bool drawn_in = false;
};
Pull pull_of(const DebulkedNet& net, const FibreSection& section, const BridgeHold& hold);

}  // namespace debulk
