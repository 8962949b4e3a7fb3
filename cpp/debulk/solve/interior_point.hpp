#pragma once

#include "debulk/solve/method.hpp"

namespace debulk {

// An interior point made for nets: the elastic problem min f + k/2 |c|^2, y >= lower, with the fibres' tensions lambda = k c
// as unknowns of their own. Barrier and filter line search as in Waechter and Biegler (Math. Program. 106, 2006); tensions
// are eliminated from each Newton system, which leaves a narrow matrix H + Sigma + rho J^T J for a skyline Cholesky
// factorisation, and the difference between rho and k is taken back by iterative refinement. Step by step: docs/solver.md. No
// global state, no lock.
Outcome minimise_with_interior_point(const Problem& problem, const Eigen::VectorXd& start, const SolveOptions& options);

}  // namespace debulk
