#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/core/grid.hpp"

namespace debulk {

// Height of a surface above the mold frame's XY plane, with its first and second derivatives, at one point.
struct SurfaceSample {
  double height = 0.0;                                 // mm
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();  // mm/mm
  Eigen::Matrix2d hessian = Eigen::Matrix2d::Zero();   // 1/mm
};

// A surface z = F(x, y), twice continuously differentiable wherever it is sampled. The net is laid on one, and the ply
// rests on one. Reference is the measured kind; tests use exact planes, cylinders and spheres.
class Surface {
 public:
  virtual ~Surface() = default;
  virtual SurfaceSample sample(const Eigen::Vector2d& xy) const = 0;
  virtual double height(const Eigen::Vector2d& xy) const { return sample(xy).height; }
  // The heights at every point of the grid, to the same bits as height().
  virtual void heights_on(Grid<double>& grid, int threads = 0) const {
    (void)threads;
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) grid.at(i, j) = height(grid.position(i, j));
  }
  // The gradients at every (x, y) of a row, with x in ascending order.
  virtual std::vector<Eigen::Vector2d> gradients_on_row(const std::vector<double>& x, double y) const {
    std::vector<Eigen::Vector2d> out;
    out.reserve(x.size());
    for (const double at : x) out.push_back(sample({at, y}).gradient);
    return out;
  }
};

}  // namespace debulk
