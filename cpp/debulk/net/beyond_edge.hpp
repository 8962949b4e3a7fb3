#pragma once

#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// A surface that is unchanged on the ply and continues beside it as the tangent plane at the nearest point of the ply's
// edge. Nodes past the edge are trimmed, but other nodes are laid from them; where the mold ends at the ply's edge, the
// original surface beyond it does not allow nodes to be laid.
class BeyondEdge : public Surface {
 public:
  // Both arguments are kept by reference.
  BeyondEdge(const Surface& surface, const Polygon& ply_outline) : surface_(surface), outline_(ply_outline) {}

  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    if (inside(outline_, xy)) return surface_.sample(xy);
    const Eigen::Vector2d edge = nearest_on_outline(outline_, xy);
    SurfaceSample s = surface_.sample(edge);
    s.height += s.gradient.dot(xy - edge);
    s.hessian.setZero();
    return s;
  }

 private:
  const Surface& surface_;
  const Polygon& outline_;
};

}  // namespace debulk
