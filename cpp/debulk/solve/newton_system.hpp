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
// with dl eliminated at a stiffness rho = k, or milder where k is beyond what double precision carries (nearly dependent
// fibres converge slowly then): M = W + S + d + rho J^T J, which is positive definite exactly where
// W + S + d is positive on the constraints' null space (and a little beyond). Where it is not, W is taken without its part
// from fibres in compression (lambda < 0), which would buckle: what is left lets the ply slide and turn freely, where a
// shift large enough for the buckling would hold every node back. Only if that does not help either, d is the least of a
// growing sequence with which it does.
class NewtonSystem {
 public:
  // Once the stop is raised, factor() ends after the factorisation that it is computing.
  NewtonSystem(const Problem& problem, Stop stop);

  void differentiate(const Eigen::VectorXd& y);                            // J
  void assemble(const Eigen::VectorXd& y, const Eigen::VectorXd& lambda);  // W
  bool factor(const Eigen::VectorXd& sigma, double stiffness, double least_shift);
  void solve(const Eigen::VectorXd& slope, const Eigen::VectorXd& deficit, Eigen::VectorXd& dy, Eigen::VectorXd& dl);
  bool convexified() const { return convexified_; }  // the last factor() was not of W + S as they are
  double shift() const { return shift_; }            // d of the last factor()
  double last_shift() const { return last_shift_; }  // the last d that was not 0
  // The unit vector of least curvature of W + S within the constraints, as far as 15 Lanczos steps get: good enough to step off a
  // saddle; that a point is none is for the certificate to say. Overwrites the factor.
  Eigen::VectorXd softest_direction(const Eigen::VectorXd& sigma);

  Eigen::VectorXd jacobian_transposed(const Eigen::VectorXd& lambda) const;  // J^T lambda
  Eigen::VectorXd jacobian_times(const Eigen::VectorXd& y) const;            // J y
  // Least-squares multipliers: lambda that makes slope + J^T lambda small.
  Eigen::VectorXd fitted_multipliers(const Eigen::VectorXd& slope);

 private:
  void add_normal(double rho);  // rho J^T J to the matrix
  void assemble_convex();
  bool try_factor(const Eigen::VectorXd& w, const Eigen::VectorXd& sigma);
  bool shift_until_positive(const Eigen::VectorXd& w, const Eigen::VectorXd& sigma);

  const Problem& problem_;
  Stop stop_;
  int n_, m_;
  std::vector<Problem::Entry> jacobian_, hessian_;
  Eigen::VectorXd j_, w_, convex_;  // convex_: W without fibres in compression, made where it is needed
  Eigen::VectorXd y_, lambda_;      // of the last assemble()
  bool convex_known_ = false, convexified_ = false;
  struct Product {
    int one, other;     // entries of J in the same row
    std::size_t place;  // of their product in the skyline
  };
  std::vector<Product> products_;
  std::vector<std::size_t> places_;  // of the Hessian's entries
  Skyline plain_, factors_;          // W + S + d, and the factor of M
  double stiffness_ = 0, rho_ = 0, shift_ = 0, last_shift_ = 0;
};

}  // namespace debulk
