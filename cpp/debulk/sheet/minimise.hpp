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
  int starts = 1;       // the deterministic path, and starts - 1 seeded perturbations of it
  int first_start = 0;  // of them; those before it are left out, being known already
  std::uint64_t seed = 0;
  double perturbation = 0.1;  // of a start, in spacings; a smaller one finds near minima only (bench/study)
  int retries = 4;            // of a start: away from a saddle, or from a perturbed point after a failure

  void check() const;
};

// A configuration with what is known of it.
struct Minimum {
  Points nodes;
  SolveStatus status = SolveStatus::numerical_failure;
  Certificate certificate;
  std::vector<double> tensions_n;  // Judged::tensions_n
  double energy_mj = 0.0;
  int iterations = 0;  // over all retries
  int evaluations = 0;

  // Converged and certified: the only kind of success.
  bool certified() const { return (status == SolveStatus::converged || status == SolveStatus::nothing_moves) && certificate.certified(); }
};

// Finds minima of one sheet. What every start of it needs is prepared once: whether the sheet can be solved at all, and the
// sheet moved to the origin. Several threads may run starts of one Minimiser at the same time; a start's result does not
// depend on the others.
class Minimiser {
 public:
  explicit Minimiser(std::shared_ptr<const Sheet> sheet);

  // The sheet under vacuum from each start (docs/solver.md, section 10), in their order. A stopped run returns those that were begun, at
  // least the first.
  std::vector<Minimum> run(const MinimiseOptions& options, const Points* start = nullptr) const;

 private:
  Minimum from_start(const MinimiseOptions& options, const Points* start, int k) const;
  Minimum not_tried(SolveStatus status, const SolveOptions& options) const;

  std::shared_ptr<const Sheet> sheet_;
  SolveStatus refusal_;                       // why no start is tried; `converged`: nothing speaks against it
  std::shared_ptr<const Sheet> near_origin_;  // none where the sheet is refused
};

// The same for a sheet that is minimised once.
std::vector<Minimum> minimise(const Sheet& sheet, const MinimiseOptions& options, const Points* start = nullptr);

// The certified one of lowest energy, one without a compliance if there is any; if none is certified, the first.
const Minimum& best(const std::vector<Minimum>& minima);

}  // namespace debulk
