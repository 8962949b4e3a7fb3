#pragma once

#include "debulk/solve/method.hpp"

namespace debulk {

// Solves the elastic problem by a method of multipliers whose bound-constrained minimisations are NLopt's L-BFGS (J.
// Nocedal, Math. Comput. 35, 1980; L. Luksan's code). It uses first derivatives only. It is slower and less exact than
// the interior-point methods, and serves as an independent check of them. It reports `converged` at a slope of at most
// 1e-6, or of the tolerance if that is larger. An iteration is one such minimisation. NLopt is thread-safe, so there is
// no lock. It stops within one evaluation.
Outcome minimise_with_nlopt(const Problem& problem, const Eigen::VectorXd& start, const SolveOptions& options);

}  // namespace debulk
