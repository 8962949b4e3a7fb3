#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "debulk/sheet/sheet.hpp"
#include "debulk/solve/certificate.hpp"
#include "debulk/solve/options.hpp"
#include "debulk/solve/status.hpp"

namespace debulk {

struct MinimiseOptions {
  std::string method = "auto";
  SolveOptions solve;
  int starts = 1;       // the unperturbed start, and starts - 1 seeded perturbations of it
  int first_start = 0;  // number of the first start to run; those before it are skipped, because they are known already
  std::uint64_t seed = 0;
  double perturbation = 0.1;  // of a start, in spacings; a smaller one finds near minima only (bench/study)
  int retries = 4;            // per start: away from a saddle, or from a perturbed point after a failure

  void check() const;
};

// A configuration with its status, certificate, tensions and energy.
struct Minimum {
  Points nodes;
  SolveStatus status = SolveStatus::numerical_failure;
  Certificate certificate;
  std::vector<double> tensions_n;  // Judged::tensions_n
  double energy_mj = 0.0;
  int iterations = 0;  // sum over all retries
  int evaluations = 0;

  // Whether the solve converged (or nothing can move) and the result is certified: the only kind of success.
  bool certified() const { return (status == SolveStatus::converged || status == SolveStatus::nothing_moves) && certificate.certified(); }
};

// Finds minima of one sheet. The work that all starts share is done once: the test whether the sheet can be solved at
// all, and a copy of the sheet moved to the origin. Several threads may run starts of one Minimiser at the same time; a
// start's result does not depend on the others.
class Minimiser {
 public:
  explicit Minimiser(std::shared_ptr<const Sheet> sheet);

  // Solves the sheet under vacuum from each start (docs/solver.md, section 10) and returns the results in the order of
  // the starts. A stopped run returns those that were begun, at least the first. Throws InputError for options or a
  // start that are not valid.
  std::vector<Minimum> run(const MinimiseOptions& options, const Points* start = nullptr) const;

 private:
  Minimum from_start(const MinimiseOptions& options, const Points* start, int k) const;
  Minimum not_tried(SolveStatus status, const SolveOptions& options) const;

  std::shared_ptr<const Sheet> sheet_;
  SolveStatus refusal_;                       // why no start is tried; `converged` if the sheet is not refused
  std::shared_ptr<const Sheet> near_origin_;  // null if the sheet is refused
};

// Does the same for a sheet that is minimised only once.
std::vector<Minimum> minimise(const Sheet& sheet, const MinimiseOptions& options, const Points* start = nullptr);

// Returns the certified minimum of lowest energy, preferring those that needed no compliance; if none is certified, the
// first.
const Minimum& best(const std::vector<Minimum>& minima);

}  // namespace debulk
