#pragma once

#include <vector>

#include <Eigen/Core>

namespace debulk {

struct RingPoint {
  double x, y;  // columns and rows
  double z;
};

// A polynomial through the ring of measured values round a hole, of the highest degree (of 4, 2, 1, 0, at most
// `highest_degree`) that predicts no point of the hole with more noise than a single measured value has. An even degree
// is worth what the next odd one is for the crown of a bell, at less noise.
class RingFit {
 public:
  RingFit(const std::vector<RingPoint>& ring, const std::vector<RingPoint>& hole, int highest_degree);
  double operator()(double x, double y) const;
  int degree() const { return degree_; }

 private:
  Eigen::VectorXd terms(double x, double y) const;

  double x0_ = 0, y0_ = 0, scale_ = 1;
  int degree_ = 0;
  Eigen::VectorXd coefficients_;
};

}  // namespace debulk
