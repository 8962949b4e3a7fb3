#pragma once

#include <optional>
#include <string>
#include <vector>

#include "debulk/verdict/excess_rule.hpp"

namespace debulk {

// From best to worst. Of two verdicts the worse one counts.
enum class Verdict {
  cease,      // closes within the criteria, and a certificate says so
  undecided,  // the evidence lies on both sides of a limit, or is not certified
  crease,     // stays above a limit, in every certified solution found
  invalid,    // cannot be judged
};
const char* name(Verdict verdict);

// By which figures a pocket inside the ply is judged. One at the ply's edge is judged as in `paper`: ply slides in there, and
// the excess of the fibres that are held is no bound.
enum class Criterion {
  excess,  // the ridge that the largest excess of a held fibre makes, and no bridge above the limit
  paper,   // RMS, ridges and bridges of the minima
};

// What is accepted. The RMS limit is the paper's, the nominal ply thickness; it dilutes (a 1 mm ridge passes in a pocket wider
// than about 20 mm), so ridge height has a limit of its own, provisional until the study chooses (docs/model.md, section 7).
struct Criteria {
  Criterion criterion = Criterion::excess;
  double max_rms = 0.30;              // mm, of the post-processed gaps inside the perimeter
  double max_ridge_height = 0.60;     // mm; bridging ply must stay below it too
  double min_coverage = 0.98;         // share of the ply that the scan must have seen
  double min_pocket_coverage = 0.80;  // share of a pocket's area; the rest was filled by the height map's rule
  // mm; a figure nearer to its limit decides nothing: other starts, or a second scan, move it about as much (bench/study).
  double rms_margin = 0.01;
  double ridge_margin = 0.05;
  double excess_margin = 0.02;  // of the ridge that the excess length makes (ExcessRidge)
  // mm; the same where the length constraints needed a compliance. A strain of 1e-3 has been seen to move an RMS by 0.018 mm.
  double compliance_margin = 0.05;

  void check() const;
};

// What is known of one pocket. The defaults prove nothing: a pocket is UNDECIDED until it is certified.
struct PocketEvidence {
  bool inside_ply = false;             // every node of the rim is held
  std::optional<Spread> excess_ridge;  // mm, ExcessRidge::range; none: the excess could not be extrapolated
  bool no_bridge = false;              // no fibre is short enough to bridge up to the limit, whatever the minimum
  // Of the minima:
  Spread rms;                // mm
  Spread ridge_height;       // mm, 0: no ridge
  Spread bridge_height;      // mm, 0: no bridging
  bool certified = false;    // the certificate of docs/certificate.md holds for every solution in the ranges
  bool compliant = false;    // the length error is above 1e-4: a compliance was needed
  std::string solve_status;  // the solver's outcome in words, for the reason
  bool deadline_passed = false;
  double coverage = 1.0;   // measured share of the pocket's area
  bool closed_rim = true;  // fixed nodes close the rim, or the pocket lies at the ply's edge
  std::string refused;     // why it was not evaluated at all; empty: it was
};

struct Judgement {
  Verdict verdict = Verdict::invalid;
  std::string reason;                                  // one sentence, with the numbers
  std::optional<Criterion> decided_by = std::nullopt;  // none: no figure decided
};

// INVALID > CREASE > UNDECIDED > CEASE. By the minima's figures nothing is better or worse than UNDECIDED without a certificate: a
// truncated solve still has the height of the pocket it began with. By the excess, CREASE needs no minimum, since every one of them
// keeps the excess; CEASE needs a certified one, or no_bridge, because a short fibre may bridge.
Judgement judge(const PocketEvidence& evidence, const Criteria& criteria = {});

// A pocket's number in the report with its judgement.
struct JudgedPocket {
  int id = 0;
  Judgement judgement;
};

// The layup takes the worst pocket's; INVALID where the scan saw too little of the ply, CEASE where it saw enough and no pocket.
Judgement judge_layup(const std::vector<JudgedPocket>& pockets, double coverage, const Criteria& criteria = {});

}  // namespace debulk
