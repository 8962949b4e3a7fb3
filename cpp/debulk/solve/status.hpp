#pragma once

namespace debulk {

// How a minimisation ended. Only `converged` or `nothing_moves` with a certificate is a success; the certificate is
// computed independently of the method, from the returned point alone.
enum class SolveStatus {
  converged,              // the method's own first-order test is met
  nothing_moves,          // no node may move: the start is the answer
  iteration_limit,        // stopped at max_iterations
  deadline,               // stopped by the deadline
  cancelled,              // stopped from another thread
  infeasible,             // the method ended at a point that violates the constraints
  numerical_failure,      // an evaluation gave not-a-number, a factorisation failed for good, or there was no more progress
  too_few_movable_nodes,  // refused before the solve: more length equations than unknowns
  no_minimum,             // refused before the solve, or found during it: nothing holds the ply against its load
  not_a_surface,          // refused before the solve: segments far from their length, as between nodes that coincide
  too_stiff               // refused before the solve: the load is too weak against the springs for the certificate to see it
};

const char* name(SolveStatus status);
const char* explanation(SolveStatus status);

}  // namespace debulk
