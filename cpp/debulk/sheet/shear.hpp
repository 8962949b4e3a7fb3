#pragma once

#include "debulk/net/net.hpp"
#include "debulk/sheet/angle_term.hpp"

namespace debulk {

// Paper eq. (4), summed over nodes: G/2 (Delta/2)^2 t sum of gamma_j^2, gamma_j = |pi/2 - phi_j|. The sum is over the
// up to four corners of a node, each formed with one neighbour along each fibre. The undeformed angle is 90 degrees
// (docs/model.md, section 3).
class Shear : public AngleTerm {
 public:
  Shear(double shear_mpa, double spacing_mm, double thickness_mm, const std::vector<Neighbours>& neighbours)
      : AngleTerm(shear_batch, +1.0, shear_mpa / 2 * (spacing_mm / 2) * (spacing_mm / 2) * thickness_mm, corners(neighbours)) {}

  static std::vector<Corner> corners(const std::vector<Neighbours>& neighbours) {
    std::vector<Corner> out;
    for (std::size_t i = 0; i < neighbours.size(); ++i)
      for (const Direction first : {east, west})
        for (const Direction second : {north, south})
          if (neighbours[i][first] >= 0 && neighbours[i][second] >= 0)
            out.push_back({static_cast<int>(i), neighbours[i][first], neighbours[i][second]});
    return out;
  }
};

}  // namespace debulk
