#pragma once

#include "debulk/solve/method.hpp"

namespace debulk {

// The elastic problem by a method of multipliers whose bound-constrained minimisations are NLopt's L-BFGS (J. Nocedal,
// Math. Comput. 35, 1980; L. Luksan's code). First derivatives only: slower than the interior points and less exact, and
// so an independent referee. It says `converged` with a slope of 1e-6 at most, or the tolerance if that is larger.
// An iteration is one such minimisation. NLopt is thread-safe: no lock. Stops within one evaluation.
Outcome minimise_with_nlopt(const Problem& problem, const Eigen::VectorXd& start, const SolveOptions& options);

}  // namespace debulk
