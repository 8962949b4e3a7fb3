#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/core/stop.hpp"
#include "debulk/solve/problem.hpp"
#include "debulk/solve/skyline.hpp"

namespace debulk {

// The Newton system of an elastic problem at one iterate (docs/solver.md, section 4),
//   [ W + S + d    J^T ] [dy]   [slope  ]        W: Hessian of f + lambda . c,  S: diagonal of the bounds,
//   [ J          - 1/k ] [dl] = [deficit],       k: the stiffness,  d: a shift, mostly 0,
// with dl eliminated at a stiffness rho = k, or a smaller one if double precision does not suffice for k (nearly
// dependent fibres then converge slowly). This gives M = W + S + d + rho J^T J, which is positive definite if W + S + d
// is positive on the constraints' null space, or nearly so. If M is not, W is used without its part from fibres in
// compression (lambda < 0), which would buckle. The rest of W lets the ply slide and turn freely, whereas a shift large
// enough to prevent the buckling would hold back every node. Only if that does not help either, d is the first of a
// growing sequence of shifts with which M is positive definite.
class NewtonSystem {
 public:
  // When the stop is raised, factor() ends after the factorisation that it is computing.
  NewtonSystem(const Problem& problem, Stop stop);

  void differentiate(const Eigen::VectorXd& y);                            // J
  void assemble(const Eigen::VectorXd& y, const Eigen::VectorXd& lambda);  // W
  // From now on, no more of the compression is left out than has to be, or again all of it, which is right far from the
  // answer. Near a saddle the steps would creep without all that need not be left out.
  void spare(bool sparing) { sparing_ = sparing; }
  bool factor(const Eigen::VectorXd& sigma, double stiffness, double least_shift);
  void solve(const Eigen::VectorXd& slope, const Eigen::VectorXd& deficit, Eigen::VectorXd& dy, Eigen::VectorXd& dl);
  bool convexified() const { return convexified_; }  // whether the last factor() changed or shifted W
  double shift() const { return shift_; }            // d of the last factor()
  double last_shift() const { return last_shift_; }  // the last d that was not 0
  // Returns the unit vector of least curvature of W + S within the constraints, approximated by 15 Lanczos steps. That
  // is good enough to step off a saddle; whether a point is a saddle is decided by the certificate. Overwrites the
  // factor.
  Eigen::VectorXd softest_direction(const Eigen::VectorXd& sigma);

  Eigen::VectorXd jacobian_transposed(const Eigen::VectorXd& lambda) const;  // J^T lambda
  Eigen::VectorXd jacobian_times(const Eigen::VectorXd& y) const;            // J y
  // Returns the least-squares multipliers: the lambda that makes slope + J^T lambda small.
  Eigen::VectorXd fitted_multipliers(const Eigen::VectorXd& slope);

 private:
  void add_normal(double rho);  // adds rho J^T J to the matrix
  void assemble_convex();
  bool try_factor(const Eigen::VectorXd& w, const Eigen::VectorXd& sigma);
  bool shift_until_positive(const Eigen::VectorXd& w, const Eigen::VectorXd& sigma);

  const Problem& problem_;
  Stop stop_;
  int n_, m_;
  std::vector<Problem::Entry> jacobian_, hessian_;
  Eigen::VectorXd j_, w_, convex_;  // convex_: W without fibres in compression, computed only if it is needed
  Eigen::VectorXd y_, lambda_;      // arguments of the last assemble()
  bool convex_known_ = false, convexified_ = false, sparing_ = false;
  struct Product {
    int one, other;     // entries of J in the same row
    std::size_t place;  // place of their product in the skyline
  };
  std::vector<Product> products_;
  std::vector<std::size_t> places_;  // places of the Hessian's entries
  Skyline plain_, factors_;          // W + S + d, and the factor of M
  double share_ = 1;                 // of the compression, left out by the last factor() that had to
  double stiffness_ = 0, rho_ = 0, shift_ = 0, last_shift_ = 0;
};

}  // namespace debulk
