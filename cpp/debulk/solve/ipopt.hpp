#pragma once

#include "debulk/solve/method.hpp"

namespace debulk {

// Ipopt's interior-point method with the exact Hessian, as Debian ships it (3.11.9 with MUMPS). Its MUMPS is not safe
// to run on two threads at once, so a process-wide lock is held for the whole solve. It stops within an iteration of
// the deadline.
Outcome minimise_with_ipopt(const Problem& problem, const Eigen::VectorXd& start, const SolveOptions& options);

}  // namespace debulk
