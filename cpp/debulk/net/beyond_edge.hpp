#pragma once

#include <algorithm>
#include <limits>

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
    const Eigen::Vector2d edge = nearest(xy);
    SurfaceSample s = surface_.sample(edge);
    s.height += s.gradient.dot(xy - edge);
    s.hessian.setZero();
    return s;
  }

 private:
  Eigen::Vector2d nearest(const Eigen::Vector2d& xy) const {
    Eigen::Vector2d best = xy;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < outline_.size(); ++k) {
      const Eigen::Vector2d from = outline_[k], side = outline_[(k + 1) % outline_.size()] - from;
      const double squared = side.squaredNorm();
      const double share = squared > 0 ? std::min(1.0, std::max(0.0, (xy - from).dot(side) / squared)) : 0.0;
      const Eigen::Vector2d at = from + share * side;
      if (const double away = (xy - at).squaredNorm(); away < least) least = away, best = at;
    }
    return best;
  }

  const Surface& surface_;
  const Polygon& outline_;
};

}  // namespace debulk
