#pragma once

#include <cstdint>
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
  double energy_mj = 0.0;
  int iterations = 0;  // over all retries
  int evaluations = 0;

  // Converged and certified: the only kind of success.
  bool certified() const { return (status == SolveStatus::converged || status == SolveStatus::nothing_moves) && certificate.certified(); }
};

// The sheet under vacuum, from each start (docs/solver.md, section 10). Ordered as the starts; a stopped run returns those
// begun, the first at least.
std::vector<Minimum> minimise(const Sheet& sheet, const MinimiseOptions& options, const Points* start = nullptr);

// The same for several sheets at once, on up to `threads` threads (0: as many as the process may use): result k is that of
// sheet k alone, bit for bit.
std::vector<std::vector<Minimum>> minimise_all(const std::vector<const Sheet*>& sheets, const MinimiseOptions& options, int threads = 0);

// The certified one of lowest energy, one without a compliance if there is any; if none is certified, the first.
const Minimum& best(const std::vector<Minimum>& minima);

}  // namespace debulk
