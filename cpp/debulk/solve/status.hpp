#pragma once

namespace debulk {

// How a minimisation ended. Only `converged` with a certificate is a success; the certificate is computed apart from the
// method, from the returned point alone.
enum class SolveStatus {
  converged,              // the method's own first-order test is met
  nothing_moves,          // no node may move: the start is the answer
  iteration_limit,        // stopped at max_iterations
  deadline,               // stopped by the deadline
  cancelled,              // stopped from another thread
  infeasible,             // the method ended at a point that violates the constraints
  numerical_failure,      // not-a-number in an evaluation, or a factorisation failed for good
  too_few_movable_nodes,  // refused up front: more length equations than unknowns
  no_minimum,             // refused up front, or left for during the solve: nothing holds the ply against its load
  not_a_surface           // refused up front: segments far from their length, as between nodes that coincide
};

const char* name(SolveStatus status);
const char* explanation(SolveStatus status);

}  // namespace debulk
