#include "debulk/ridge/held_excess.hpp"

#include <algorithm>

#include "debulk/ridge/mold_length.hpp"

namespace debulk {

HeldExcess held_excess(const Net& laid, const Surface& mold) {
  HeldExcess out;
  for (const std::vector<int>& fibre : fibres(laid.neighbours)) {
    if (laid.kinds[fibre.front()] != NodeKind::fixed || laid.kinds[fibre.back()] != NodeKind::fixed) continue;
    std::vector<Eigen::Vector3d> ply;
    for (const int n : fibre) ply.push_back(laid.nodes[n]);
    ++out.fibres;
    out.largest = std::max(out.largest, fibre_excess(ply, mold));
  }
  return out;
}

}  // namespace debulk
