#pragma once

#include "debulk/net/net.hpp"
#include "debulk/sheet/angle_term.hpp"

namespace debulk {

// Paper eq. (2), summed over nodes: c/2 [(2 Psi_1)^2 + (2 Psi_2)^2], c = E t^3 / 12, where 2 Psi is the turning angle
// of a fibre at the node. It is the full angle in space and is counted wherever the fibre continues on both sides of
// the node, also at fixed nodes (which makes a clamp).
class Bending : public AngleTerm {
 public:
  Bending(double c_mj, const std::vector<Neighbours>& neighbours) : AngleTerm(turning_batch, -1.0, c_mj / 2, corners(neighbours)) {}

  static std::vector<Corner> corners(const std::vector<Neighbours>& neighbours) {
    std::vector<Corner> out;
    for (std::size_t i = 0; i < neighbours.size(); ++i)
      for (const auto& [one, other] : {std::pair{east, west}, std::pair{north, south}})
        if (neighbours[i][one] >= 0 && neighbours[i][other] >= 0)
          out.push_back({static_cast<int>(i), neighbours[i][one], neighbours[i][other]});
    return out;
  }
};

}  // namespace debulk
