#pragma once

#include <algorithm>

#include <Eigen/Core>

namespace debulk {

// The area that two vectors span, positive if b lies to the left of a.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

// Whether a ray from a point along +x crosses the side from a to b, of whose ends the lower one belongs to it.
inline bool is_crossed(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& point) {
  return (a.y() > point.y()) != (b.y() > point.y()) && point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
}

// The point of the side from a to b that is nearest to a point.
inline Eigen::Vector2d nearest_on(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& point) {
  const Eigen::Vector2d side = b - a;
  const double length2 = side.squaredNorm();
  const double t = length2 > 0 ? std::clamp((point - a).dot(side) / length2, 0.0, 1.0) : 0.0;
  return a + t * side;
}

}  // namespace debulk
