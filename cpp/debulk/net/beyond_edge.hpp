#pragma once

#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// A surface as it is on the ply; beside the ply it goes on as the tangent plane at the nearest point of the ply's edge. Nodes past
// the edge are trimmed, but others hang on them: where the mold ends there, none can be laid on what lies below.
class BeyondEdge : public Surface {
 public:
  // Both are kept by reference.
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
