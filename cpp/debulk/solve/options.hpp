#pragma once

#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Options of one minimisation, for any method.
struct SolveOptions {
  double tolerance = 1e-8;  // of the scaled first-order conditions; a method stops when they are met
  int max_iterations = 1000;
  double stiffness = 1e8;  // k of the compliance 1/k on the equalities (elastic.hpp), in units of the scaled problem
  Stop stop;               // deadline and cancellation, tested once per iteration

  void check() const {
    require(std::isfinite(tolerance) && tolerance > 0, "tolerance", "a positive number", tolerance);
    require(max_iterations >= 1, "max_iterations", "1 or more", max_iterations);
    require(std::isfinite(stiffness) && stiffness > 0, "stiffness", "a positive number", stiffness);
  }
};

}  // namespace debulk
