#pragma once

#include <Eigen/Core>

namespace debulk {

// The area that two vectors span, positive if b lies to the left of a.
inline double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

}  // namespace debulk
