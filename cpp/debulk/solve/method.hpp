#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "debulk/solve/options.hpp"
#include "debulk/solve/problem.hpp"
#include "debulk/solve/status.hpp"

namespace debulk {

// The result of a method: its last point, and the status that the method reports. The status is not trusted without a
// certificate.
struct Outcome {
  Eigen::VectorXd y;
  SolveStatus status = SolveStatus::numerical_failure;
  int iterations = 0;
  int evaluations = 0;  // of f
};

// The common signature of the minimisers, so that the sheet does not depend on a particular one. Each gives the
// equalities the compliance 1/k of the options (elastic.hpp).
using Method = Outcome (*)(const Problem&, const Eigen::VectorXd& start, const SolveOptions&);

// Returns the method of this name: "interior_point", "ipopt" or "nlopt"; "auto" is the default, "interior_point".
// Throws InputError for any other name.
Method method(const std::string& name);
std::vector<std::string> method_names();

}  // namespace debulk
