#include "debulk/solve/status.hpp"

namespace debulk {

const char* name(SolveStatus status) {
  switch (status) {
    case SolveStatus::converged:
      return "converged";
    case SolveStatus::nothing_moves:
      return "nothing_moves";
    case SolveStatus::iteration_limit:
      return "iteration_limit";
    case SolveStatus::deadline:
      return "deadline";
    case SolveStatus::cancelled:
      return "cancelled";
    case SolveStatus::infeasible:
      return "infeasible";
    case SolveStatus::numerical_failure:
      return "numerical_failure";
    case SolveStatus::too_few_movable_nodes:
      return "too_few_movable_nodes";
    case SolveStatus::no_minimum:
      return "no_minimum";
    case SolveStatus::not_a_surface:
      return "not_a_surface";
    case SolveStatus::too_stiff:
      return "too_stiff";
  }
  return "unknown";
}

const char* explanation(SolveStatus status) {
  switch (status) {
    case SolveStatus::converged:
      return "the solve converged";
    case SolveStatus::nothing_moves:
      return "no node may move";
    case SolveStatus::iteration_limit:
      return "the solve reached its limit of iterations";
    case SolveStatus::deadline:
      return "the deadline passed during the solve";
    case SolveStatus::cancelled:
      return "the solve was cancelled";
    case SolveStatus::infeasible:
      return "the solve found no configuration with inextensible fibres above the mold";
    case SolveStatus::numerical_failure:
      return "the solve failed numerically";
    case SolveStatus::too_few_movable_nodes:
      return "the net has too few movable nodes for its fibres to be inextensible";
    case SolveStatus::no_minimum:
      return "no node is fixed, and friction does not hold the ply on the mold where it lies or comes to rest";
    case SolveStatus::not_a_surface:
      return "the net is no surface: segments are far from their length, or nodes coincide";
    case SolveStatus::too_stiff:
      return "the ply's own springs are a million times as strong as its load, or more, so that no residual shows whether the load is in "
             "balance: check its moduli, its thickness and the pressure";
  }
  return "unknown";
}

}  // namespace debulk
