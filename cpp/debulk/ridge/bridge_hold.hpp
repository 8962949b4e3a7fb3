#pragma once

#include <array>
#include <vector>

#include "debulk/net/fibre_net.hpp"
#include "debulk/ridge/fibre_section.hpp"

namespace debulk {

// What pulls at a ply that bridges a hollow, and what could hold it. The model pins the rim, so that a fibre too short for its mold
// by a few um stands taut over it. On a part only the friction between ply and mold holds it, over the way from the pocket to the
// ply's edge, mu P d a width; a fibre that pulls harder slips, and the ply is drawn in (docs/model.md, section 5).
struct BridgeHold {
  std::vector<std::array<double, 4>> tension;  // N/mm, of the segment from each node to each neighbour; 0 where there is none
  std::vector<std::array<double, 2>> most;     // N/mm that friction holds along each of a node's two fibres
};

// tensions_n: of each of segments(laid.net.neighbours), pull positive. Empty where they or the ply's edge are not known.
BridgeHold bridge_hold(const PocketNet& laid, const std::vector<double>& tensions_n, double friction, double pressure_mpa);

// How a taut section stands.
struct Pull {
  double tension = 0.0;  // N/mm, mean of its segments
  double most = 0.0;     // N/mm, what holds it
  // It slips, and far enough to lie down: with the tension that friction can hold the ply turns as much as the mold below
  // it does, the load being the same. A ply that slips and still spans the hollow is a bridge.
  bool drawn_in = false;
};
Pull pull_of(const DebulkedNet& net, const FibreSection& section, const BridgeHold& hold);

}  // namespace debulk
