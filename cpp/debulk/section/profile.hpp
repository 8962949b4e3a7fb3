#pragma once

#include <vector>

#include <Eigen/Core>

namespace debulk {

// The mold's cross-section z = F(x): a natural cubic spline through its points that continues straight beyond its ends,
// so that it is twice continuously differentiable everywhere. Without points it is flat, z = 0.
class SectionProfile {
 public:
  struct Sample {
    double height = 0, slope = 0, curvature = 0;  // F, F', F''
  };

  SectionProfile() = default;
  // points: at least two (x, z), with x strictly increasing.
  explicit SectionProfile(std::vector<Eigen::Vector2d> points);

  Sample at(double x) const;
  // Returns points on the curve at equal steps of x from `from` to `to`, both included.
  Eigen::Matrix2Xd line(double from, double to, int segments) const;

 private:
  std::vector<Eigen::Vector2d> points_;
  std::vector<double> second_;  // F'' at the points
};

// Returns the running length of a polyline at its points: 0 at the first, the whole length at the last.
Eigen::VectorXd running_length(const Eigen::Matrix2Xd& line);

}  // namespace debulk
