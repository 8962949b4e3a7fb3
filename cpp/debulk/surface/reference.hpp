#pragma once

#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// The C2 bicubic spline that interpolates heights on a regular grid (not-a-knot at the borders, so that cubics are
// reproduced exactly). Outside the grid it goes on with the border's value and slope, and its curvature fades out over
// a grid spacing. It is still C2 there and grows no faster than linearly, so that a solver may step there.
class Reference : public Surface {
 public:
  // heights: at least 4 by 4, all finite, mm. Throws InputError otherwise.
  explicit Reference(Grid<double> heights);

  SurfaceSample sample(const Eigen::Vector2d& xy) const override { return sample_at(heights_.locate(xy)); }
  SurfaceSample sample_at(const Eigen::Vector2d& u) const;  // the same; u in grid spacings from the first height
  double height(const Eigen::Vector2d& xy) const override;  // sample(xy).height, to the same bits
  void heights_on(Grid<double>& grid, int threads = 0) const override;
  std::vector<Eigen::Vector2d> gradients_on_row(const std::vector<double>& x, double y) const override;
  bool inside(const Eigen::Vector2d& xy) const;
  const Grid<double>& heights() const { return heights_; }

 private:
  Grid<double> heights_;
  std::vector<double> coefficients_;  // (ny + 2) x (nx + 2) cubic B-spline coefficients, row-major
};

}  // namespace debulk
