#pragma once

#include <optional>
#include <string>
#include <vector>

namespace debulk {

// The least and the greatest value that a figure may have: over the certified solutions from several starts, or within
// its uncertainty.
struct Spread {
  double low = 0.0;
  double high = 0.0;
};

// The verdicts, from best to worst. Of two verdicts the worse one counts.
enum class Verdict {
  cease,      // the pocket closes within the criteria, and this is certified or proven
  undecided,  // the evidence lies on both sides of a limit, or is not certified
  crease,     // a figure stays above a limit: the excess's ridge, or a figure in every certified solution found
  invalid,    // the pocket cannot be judged
};
const char* name(Verdict verdict);

// The figures by which a pocket inside the ply is judged. A pocket at the ply's edge is always judged as in `paper`:
// there the ply slides in, and the excess of the held fibres is not a bound.
enum class Criterion {
  excess,  // the ridge that the largest excess of a held fibre makes, and no bridge above the limit
  paper,   // RMS, ridges and bridges of the minima
};

// The limits of what is accepted. The RMS limit is the paper's, the nominal ply thickness. The RMS dilutes ridges (a 1
// mm ridge passes in a pocket wider than about 20 mm), so ridge height has a limit of its own, which is provisional
// until the study chooses one (docs/model.md, section 7).
struct Criteria {
  Criterion criterion = Criterion::excess;
  double max_rms = 0.30;              // mm, of the post-processed gaps inside the perimeter
  double max_ridge_height = 0.60;     // mm; bridging ply must stay below it too
  double min_coverage = 0.98;         // share of the ply that the scan must have seen
  double min_pocket_coverage = 0.80;  // share of a pocket's area that must be measured; the rest is filled in the height map
  // mm; a figure nearer to its limit than this decides nothing, because other starts or a second scan change it by
  // about as much (bench/study).
  double rms_margin = 0.01;
  double ridge_margin = 0.05;
  // mm; the margin if the length constraints needed a compliance. A strain of 1e-3 was observed to change an RMS by
  // 0.018 mm.
  double compliance_margin = 0.05;

  void check() const;
};

// The evidence about one pocket. The defaults prove nothing: a pocket is UNDECIDED until it is certified.
struct PocketEvidence {
  bool inside_ply = false;             // true: the rim is held, or the ridge of the excess keeps the limit even if it is
  std::optional<Spread> excess_ridge;  // mm, that the excess length of the fibres makes; no value: it is not known
  Spread bridge_height;                // mm, 0: no bridging; not finite: not known
  // Figures of the minima:
  Spread rms;                // mm
  Spread ridge_height;       // mm, 0: no ridge
  bool certified = false;    // true: the certificate of docs/certificate.md holds for every solution in the ranges
  bool compliant = false;    // true: the length error is above 1e-4, so a compliance was needed
  std::string solve_status;  // the solver's outcome in words, for the reason
  bool deadline_passed = false;
  double coverage = 1.0;   // measured share of the pocket's area
  bool closed_rim = true;  // true: fixed nodes close the rim, or the pocket lies at the ply's edge
  std::string refused;     // why the pocket was not evaluated at all; empty if it was
};

struct Judgement {
  Verdict verdict = Verdict::invalid;
  std::string reason;                                  // one sentence, with the numbers
  std::optional<Criterion> decided_by = std::nullopt;  // no value: no figure decided
};

// Judges one pocket, in the order INVALID > CREASE > UNDECIDED > CEASE. By the figures of the minima, a pocket without
// a certificate is always UNDECIDED, because a truncated solve still has the height of the pocket with which it began.
// The excess needs no minimum, since every minimum keeps it. Throws InputError for evidence or criteria that are not valid.
Judgement judge(const PocketEvidence& evidence, const Criteria& criteria = {});

// A pocket's number in the report, with its judgement.
struct JudgedPocket {
  int id = 0;
  Judgement judgement;
};

// Returns the layup's judgement: that of the worst pocket; INVALID if the scan saw too little of the ply, CEASE if it
// saw enough and there is no pocket.
Judgement judge_layup(const std::vector<JudgedPocket>& pockets, double coverage, const Criteria& criteria = {});

}  // namespace debulk
