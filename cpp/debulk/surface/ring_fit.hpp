#pragma once

#include <vector>

#include <Eigen/Core>

namespace debulk {

struct RingPoint {
  double x, y;  // column and row
  double z;
};

// A polynomial through the ring of measured values round a hole. Its degree is the highest (of 4, 2, 1, 0, at most
// `highest_degree`) that predicts no point of the hole with more noise than a single measured value has. For the crown
// of a bell an even degree is as good as the next odd one, with less noise. Allocates nothing.
class RingFit {
 public:
  RingFit(const std::vector<RingPoint>& ring, const std::vector<RingPoint>& hole, int highest_degree);
  double operator()(double x, double y) const;
  int degree() const { return fit_.degree; }

 private:
  static constexpr int highest = 4;
  // Coefficients of u^a v^b, a + b <= degree. The normal equations have twice the degree.
  struct Polynomial {
    int degree = 0;
    double of[2 * highest + 1][2 * highest + 1] = {};
    double operator()(double u, double v) const;
  };
  Polynomial moments(const std::vector<RingPoint>& ring, Polynomial& heights) const;
  double across(double x) const { return (x - x0_) * inverse_; }  // ring and hole lie within [-1, 1]
  double along(double y) const { return (y - y0_) * inverse_; }

  double x0_ = 0, y0_ = 0, inverse_ = 1;
  Polynomial fit_;
};

}  // namespace debulk
