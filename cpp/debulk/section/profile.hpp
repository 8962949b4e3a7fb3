#pragma once

#include <vector>

#include <Eigen/Core>

namespace debulk {

// The mold's cross-section z = F(x): a natural cubic spline through its points, which goes on straight beyond its ends, so
// that it is twice continuously differentiable everywhere. Without points it is flat, z = 0.
class SectionProfile {
 public:
  struct Sample {
    double height = 0, slope = 0, curvature = 0;  // F, F', F''
  };

  SectionProfile() = default;
  // (x, z), x strictly increasing, at least two.
  explicit SectionProfile(std::vector<Eigen::Vector2d> points);

  Sample at(double x) const;
  // Points on the curve at equal steps of x from `from` to `to`, both included.
  Eigen::Matrix2Xd line(double from, double to, int segments) const;

 private:
  std::vector<Eigen::Vector2d> points_;
  std::vector<double> second_;  // F'' at the points
};

// Running length of a polyline: 0 at its first point, its whole length at the last.
Eigen::VectorXd running_length(const Eigen::Matrix2Xd& line);

}  // namespace debulk
