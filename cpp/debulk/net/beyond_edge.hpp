#pragma once

#include "debulk/pocket/outline_search.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// A surface that is unchanged under the ply and continues beside it as the tangent plane at the nearest point of the ply's edge. The
// nodes past the edge are trimmed, but nodes of the ply are laid from them: where the mold ends beside the ply, nodes that follow its
// cliff down shear all cells that are laid from them, and some cannot be laid at all.
class BeyondEdge : public Surface {
 public:
  // Both arguments are kept by reference.
  BeyondEdge(const Surface& surface, const OutlineSearch& ply_edge) : surface_(surface), edge_(ply_edge) {}

  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    if (edge_.inside(xy)) return surface_.sample(xy);
    const Eigen::Vector2d edge = edge_.nearest_point(xy);
    SurfaceSample s = surface_.sample(edge);
    s.height += s.gradient.dot(xy - edge);
    s.hessian.setZero();
    return s;
  }

 private:
  const Surface& surface_;
  const OutlineSearch& edge_;
};

}  // namespace debulk
