#pragma once

#include <Eigen/Core>

namespace debulk {

// Height of a surface above the mold frame's XY plane with its first and second derivatives, at one point.
struct SurfaceSample {
  double height = 0.0;                                 // mm
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  // mm/mm
  Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();   // 1/mm
};

// A surface z = F(x, y), twice continuously differentiable wherever it is asked. The net is laid on one and the ply rests
// on one; Reference is the measured kind, tests use exact planes, cylinders and spheres.
class Surface {
 public:
  virtual ~Surface() = default;
  virtual SurfaceSample sample(const Eigen::Vector2d& xy) const = 0;
  virtual double height(const Eigen::Vector2d& xy) const { return sample(xy).height; }
};

}  // namespace debulk
