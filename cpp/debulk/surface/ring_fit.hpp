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
// is worth what the next odd one is for the crown of a bell, at less noise. Allocates nothing.
class RingFit {
 public:
  RingFit(const std::vector<RingPoint>& ring, const std::vector<RingPoint>& hole, int highest_degree);
  double operator()(double x, double y) const;
  int degree() const { return degree_; }

 private:
  static constexpr int most = 15;  // coefficients, of degree 4
  using Terms = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most, 1>;
  using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most, most>;

  int terms(double x, double y, double* out) const;

  double x0_ = 0, y0_ = 0, scale_ = 1;
  int degree_ = 0;
  Terms coefficients_;
};

}  // namespace debulk
