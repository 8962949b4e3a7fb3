#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "debulk/solve/options.hpp"
#include "debulk/solve/problem.hpp"
#include "debulk/solve/status.hpp"

namespace debulk {

// What a method returns: its last point and what it says of it. Nobody trusts that without a certificate.
struct Outcome {
  Eigen::VectorXd y;
  SolveStatus status = SolveStatus::numerical_failure;
  int iterations = 0;
  int evaluations = 0;  // of f
};

// A minimiser behind one signature, so that the sheet does not know which one it has. Each gives the equalities the
// compliance 1/k of the options (elastic.hpp).
using Method = Outcome (*)(const Problem&, const Eigen::VectorXd& start, const SolveOptions&);

// By name: "interior_point", "ipopt", "nlopt"; "auto" is the default, "interior_point". Throws InputError on another name.
Method method(const std::string& name);
std::vector<std::string> method_names();

}  // namespace debulk
