#pragma once

#include "debulk/solve/method.hpp"

namespace debulk {

// An interior-point method made for nets. It solves the elastic problem min f + k/2 |c|^2, y >= lower, with the fibres'
// tensions lambda = k c as separate unknowns. Barrier and filter line search are those of Waechter and Biegler (Math.
// Program. 106, 2006). The tensions are eliminated from each Newton system, which leaves a narrow matrix H + Sigma +
// rho J^T J for a skyline Cholesky factorisation; iterative refinement corrects for the difference between rho and k.
// docs/solver.md describes the method step by step. It has no global state and needs no lock.
Outcome minimise_with_interior_point(const Problem& problem, const Eigen::VectorXd& start, const SolveOptions& options);

}  // namespace debulk
