#include "debulk/verdict/judge.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

// With a decimal point under every locale, unlike printf.
std::string number(double value, int decimals) {
  std::array<char, 400> text;  // the largest double has 309 digits
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals).ptr};
}

std::string percent(double share) {
  return number(100 * share, 1) + " %";
}

// A share that was seen is never said to be more than it was, so that it differs from the one that is needed.
std::string too_little(double seen, const char* what, double needed) {
  return "only " + percent(std::floor(1000 * seen) / 1000) + what + percent(needed) + " is needed";
}

// mm; air lifts no ply so high. What filters may have taken from sparse points grows beyond all bounds, and an upper end above
// this says no more than that.
constexpr double kMostSaid = 25.0;

// One figure that is judged: its name, range, limit and margin.
struct Figure {
  const char* name;
  Spread range;
  double limit;
  double margin;

  // Returns two decimals, or three if two could print the figure as its limit.
  int decimals() const {
    const double nearest = std::min(std::abs(range.low - limit), std::abs(range.high - limit));
    return nearest > 0 && nearest < 0.01 ? 3 : 2;
  }
  std::string value() const {
    const std::string low = number(range.low, decimals()), high = number(range.high, decimals());
    std::string text = std::string(name) + " ";
    if (range.low <= kMostSaid && range.high > kMostSaid) return text + low + " mm or more (nothing bounds it)";
    if (low != high) text += low + " to ";
    return text + high + " mm";
  }
  std::string limit_text() const { return "the limit of " + number(limit, decimals()) + " mm"; }
};

Verdict against_limit(const Figure& figure) {
  if (figure.range.low > figure.limit + figure.margin) return Verdict::crease;
  if (figure.range.high <= figure.limit - figure.margin) return Verdict::cease;
  return Verdict::undecided;
}

std::string how_it_lies(const Figure& figure, Verdict verdict) {
  if (verdict == Verdict::crease) return figure.value() + " exceeds " + figure.limit_text();
  if (verdict == Verdict::cease) return figure.value() + " keeps " + figure.limit_text();
  if (figure.range.low <= figure.limit && figure.range.high > figure.limit)
    return figure.value() + " lies on both sides of " + figure.limit_text();
  return figure.value() + " comes within " + number(figure.margin, 3) + " mm of " + figure.limit_text();
}

bool usable(const Spread& range) {
  return std::isfinite(range.low) && std::isfinite(range.high);
}

void check_range(const Spread& range, const char* argument) {
  require(!usable(range) || (range.low >= 0 && range.low <= range.high), argument, "least and most, 0 <= least <= most",
          "(" + number(range.low, 3) + ", " + number(range.high, 3) + ")");
}

// Returns why the pocket cannot be judged at all; empty if it can.
std::string cannot_be_judged(const PocketEvidence& evidence, const Criteria& criteria) {
  if (!evidence.refused.empty()) return "not evaluated: " + evidence.refused;
  if (evidence.coverage < criteria.min_pocket_coverage)
    return too_little(evidence.coverage, " of the pocket was measured, ", criteria.min_pocket_coverage);
  if (!evidence.closed_rim) return "the rim is not closed by fixed nodes, though the pocket lies inside the ply";
  return "";
}

// Returns why the figures prove nothing; empty if they do prove something.
std::string not_proven(const PocketEvidence& evidence) {
  const std::string status = evidence.solve_status.empty() ? "" : " (" + evidence.solve_status + ")";
  if (evidence.deadline_passed)
    return evidence.certified ? "the deadline passed before all starts that the rule asks for were tried"
                              : "the deadline passed before the solution was certified" + status;
  if (!evidence.certified) return "the solution is not certified" + status;
  if (!usable(evidence.rms) || !usable(evidence.ridge_height)) return "the solution has no finite figures" + status;
  return "";
}

Figure bridge(const PocketEvidence& evidence, const Criteria& criteria) {
  const double margin = std::max(criteria.ridge_margin, evidence.compliant ? criteria.compliance_margin : 0.0);
  return {"bridge", evidence.bridge_height, criteria.max_ridge_height, margin};
}

// Returns the worst verdict of the figures, with the figures that cause it as the reason.
Judgement worst_of(const std::vector<Figure>& figures, Criterion criterion) {
  Verdict worst = Verdict::cease;
  for (const Figure& figure : figures) worst = std::max(worst, against_limit(figure));
  std::string reason;
  for (const Figure& figure : figures)
    if (against_limit(figure) == worst) {
      const bool none = figure.range.high == 0 && worst == Verdict::cease;
      if (!reason.empty()) reason += ", ";
      if (none) {
        reason += std::string("no ") + figure.name;
      } else {
        reason += how_it_lies(figure, worst);
      }
    }
  return {worst, reason, criterion};
}

// Adds the bridge to the figures, and judges all. A bridge that is not known leaves a pocket that would cease in doubt.
Judgement with_bridge(std::vector<Figure> figures, const PocketEvidence& evidence, const Criteria& criteria, Criterion criterion) {
  const bool known = usable(evidence.bridge_height);
  if (known && evidence.bridge_height.high > 0) figures.insert(figures.begin() + 1, bridge(evidence, criteria));
  Judgement judged = worst_of(figures, criterion);
  if (known || judged.verdict != Verdict::cease) return judged;
  return {Verdict::undecided, judged.reason + ", but the ply may bridge the hollow below it: the mold is not known all round"};
}

Judgement by_minima(const PocketEvidence& evidence, const Criteria& criteria) {
  if (const std::string why = not_proven(evidence); !why.empty()) return {Verdict::undecided, why};
  const double least = evidence.compliant ? criteria.compliance_margin : 0;
  const double ridge_margin = std::max(criteria.ridge_margin, least), rms_margin = std::max(criteria.rms_margin, least);
  const std::vector<Figure> figures = {{"ridge", evidence.ridge_height, criteria.max_ridge_height, ridge_margin},
                                       {"RMS", evidence.rms, criteria.max_rms, rms_margin}};
  Judgement judged = with_bridge(figures, evidence, criteria, Criterion::paper);
  if (evidence.compliant && judged.verdict == Verdict::undecided) judged.reason += ", and the fibres are strained by more than 1e-4";
  return judged;
}

Judgement by_excess(const PocketEvidence& evidence, const Criteria& criteria) {
  if (!evidence.excess_ridge || !usable(*evidence.excess_ridge)) return {Verdict::undecided, "the excess length is not known"};
  // The margin of this figure is 0, because the range includes it already.
  const Figure ridge = {"ridge by the excess length", *evidence.excess_ridge, criteria.max_ridge_height, 0.0};
  return with_bridge({ridge}, evidence, criteria, Criterion::excess);
}

}  // namespace

const char* name(Verdict verdict) {
  switch (verdict) {
    case Verdict::cease:
      return "cease";
    case Verdict::undecided:
      return "undecided";
    case Verdict::crease:
      return "crease";
    case Verdict::invalid:
      break;
  }
  return "invalid";
}

void Criteria::check() const {
  require(std::isfinite(max_rms) && max_rms > 0, "max_rms_mm", "a positive limit in mm", max_rms);
  require(std::isfinite(max_ridge_height) && max_ridge_height > 0, "max_ridge_height_mm", "a positive limit in mm", max_ridge_height);
  require(min_coverage >= 0 && min_coverage <= 1, "min_coverage", "a share from 0 to 1", min_coverage);
  require(min_pocket_coverage >= 0 && min_pocket_coverage <= 1, "min_pocket_coverage", "a share from 0 to 1", min_pocket_coverage);
  require(std::isfinite(rms_margin) && rms_margin >= 0, "rms_margin_mm", "a length in mm, or 0", rms_margin);
  require(std::isfinite(ridge_margin) && ridge_margin >= 0, "ridge_margin_mm", "a length in mm, or 0", ridge_margin);
  require(std::isfinite(compliance_margin) && compliance_margin >= 0, "compliance_margin_mm", "a length in mm, or 0", compliance_margin);
}

Judgement judge(const PocketEvidence& evidence, const Criteria& criteria) {
  criteria.check();
  check_range(evidence.rms, "rms_range_mm");
  check_range(evidence.ridge_height, "ridge_range_mm");
  check_range(evidence.bridge_height, "bridge_range_mm");
  if (evidence.excess_ridge) check_range(*evidence.excess_ridge, "excess_ridge_range_mm");
  require(evidence.coverage >= 0 && evidence.coverage <= 1, "coverage", "a share from 0 to 1", evidence.coverage);

  if (const std::string why = cannot_be_judged(evidence, criteria); !why.empty()) return {Verdict::invalid, why};
  if (criteria.criterion == Criterion::excess && evidence.inside_ply) return by_excess(evidence, criteria);
  return by_minima(evidence, criteria);
}

Judgement judge_layup(const std::vector<JudgedPocket>& pockets, double coverage, const Criteria& criteria) {
  criteria.check();
  require(coverage >= 0 && coverage <= 1, "coverage", "a share from 0 to 1", coverage);
  if (coverage < criteria.min_coverage) return {Verdict::invalid, too_little(coverage, " of the ply was seen, ", criteria.min_coverage)};
  if (pockets.empty()) return {Verdict::cease, "no air pocket, and " + percent(coverage) + " of the ply was seen"};

  // Take the first of the worst pockets: the pockets are sorted with the largest first.
  const auto worst = std::max_element(pockets.begin(), pockets.end(), [](const JudgedPocket& a, const JudgedPocket& b) {
    return a.judgement.verdict < b.judgement.verdict;
  });
  const auto alike = std::count_if(pockets.begin(), pockets.end(),
                                   [&worst](const JudgedPocket& p) { return p.judgement.verdict == worst->judgement.verdict; });
  return {worst->judgement.verdict, std::to_string(alike) + " of " + std::to_string(pockets.size()) + " pockets " +
                                        name(worst->judgement.verdict) + ", pocket " + std::to_string(worst->id) + ": " +
                                        worst->judgement.reason};
}

}  // namespace debulk
