#include "debulk/verdict/judge.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

// A certified pocket that closes; each case spoils something.
PocketEvidence good() {
  PocketEvidence evidence;
  evidence.rms = {0.26, 0.26};
  evidence.certified = true;
  return evidence;
}

using Spoil = std::function<void(PocketEvidence&)>;

struct Case {
  const char* what;
  Spoil spoil;
  Verdict verdict;
  const char* reason;
};

const Case kCases[] = {
    {"as it is", [](auto&) {}, Verdict::cease, "no ridge, RMS 0.26 mm keeps the limit of 0.30 mm"},
    {"small ridge", [](auto& e) { e.ridge_height = {0.41, 0.43}; }, Verdict::cease,
     "ridge 0.41 to 0.43 mm keeps the limit of 0.60 mm, RMS 0.26 mm keeps the limit of 0.30 mm"},
    {"ridge", [](auto& e) { e.ridge_height = {1.57, 1.57}; }, Verdict::crease, "ridge 1.57 mm exceeds the limit of 0.60 mm"},
    {"RMS", [](auto& e) { e.rms = {0.354, 0.354}; }, Verdict::crease, "RMS 0.35 mm exceeds the limit of 0.30 mm"},
    {"both", [](auto& e) { e.rms = {0.42, 0.60}, e.ridge_height = {1.5, 1.6}; }, Verdict::crease,
     "ridge 1.50 to 1.60 mm exceeds the limit of 0.60 mm, RMS 0.42 to 0.60 mm exceeds the limit of 0.30 mm"},
    {"bridge", [](auto& e) { e.bridge_height = {0.9, 0.9}; }, Verdict::crease, "bridge 0.90 mm exceeds the limit of 0.60 mm"},
    {"small bridge", [](auto& e) { e.bridge_height = {0.3, 0.3}; }, Verdict::cease,
     "no ridge, bridge 0.30 mm keeps the limit of 0.60 mm, RMS 0.26 mm keeps the limit of 0.30 mm"},
    {"RMS on both sides", [](auto& e) { e.rms = {0.289, 0.331}; }, Verdict::undecided,
     "RMS 0.29 to 0.33 mm lies on both sides of the limit of 0.30 mm"},
    {"ridge on both sides", [](auto& e) { e.ridge_height = {0, 0.9}; }, Verdict::undecided,
     "ridge 0.00 to 0.90 mm lies on both sides of the limit of 0.60 mm"},
    {"an upper end that bounds nothing", [](auto& e) { e.ridge_height = {0, 5358.26}; }, Verdict::undecided,
     "ridge 0.00 mm or more (nothing bounds it) lies on both sides of the limit of 0.60 mm"},
    {"a ridge that is so high", [](auto& e) { e.ridge_height = {9.8, 12.4}; }, Verdict::crease,
     "ridge 9.80 to 12.40 mm exceeds the limit of 0.60 mm"},
    {"a ridge higher than air lifts a ply", [](auto& e) { e.ridge_height = {26.2, 26.4}; }, Verdict::crease,
     "ridge 26.20 to 26.40 mm exceeds the limit of 0.60 mm"},
    {"straddles one, above the other", [](auto& e) { e.rms = {0.2, 0.4}, e.ridge_height = {0.7, 0.8}; }, Verdict::crease,
     "ridge 0.70 to 0.80 mm exceeds the limit of 0.60 mm"},
    {"tie", [](auto& e) { e.rms = {0.302, 0.302}; }, Verdict::undecided, "RMS 0.302 mm comes within 0.010 mm of the limit of 0.300 mm"},
    {"the limit itself is a tie", [](auto& e) { e.rms = {0.30, 0.30}; }, Verdict::undecided,
     "RMS 0.30 mm comes within 0.010 mm of the limit of 0.30 mm"},
    {"just outside the tie, below", [](auto& e) { e.rms = {0.289, 0.289}; }, Verdict::cease,
     "no ridge, RMS 0.29 mm keeps the limit of 0.30 mm"},
    {"just outside the tie, above", [](auto& e) { e.rms = {0.311, 0.311}; }, Verdict::crease, "RMS 0.31 mm exceeds the limit of 0.30 mm"},
    {"a ridge's tie is wider", [](auto& e) { e.ridge_height = {0.56, 0.56}; }, Verdict::undecided,
     "ridge 0.56 mm comes within 0.050 mm of the limit of 0.60 mm"},
    {"so is a bridge's", [](auto& e) { e.bridge_height = {0.64, 0.64}; }, Verdict::undecided,
     "bridge 0.64 mm comes within 0.050 mm of the limit of 0.60 mm"},
    {"outside a ridge's", [](auto& e) { e.ridge_height = {0.66, 0.7}; }, Verdict::crease,
     "ridge 0.66 to 0.70 mm exceeds the limit of 0.60 mm"},
    {"on both sides within the margin", [](auto& e) { e.ridge_height = {0.57, 0.62}; }, Verdict::undecided,
     "ridge 0.57 to 0.62 mm lies on both sides of the limit of 0.60 mm"},
    {"strained, near a limit", [](auto& e) { e.compliant = true; }, Verdict::undecided,
     "RMS 0.26 mm comes within 0.050 mm of the limit of 0.30 mm, and the fibres are strained by more than 1e-4"},
    {"strained, far below", [](auto& e) { e.compliant = true, e.rms = {0.25, 0.25}; }, Verdict::cease,
     "no ridge, RMS 0.25 mm keeps the limit of 0.30 mm"},
    {"strained, above but near", [](auto& e) { e.compliant = true, e.rms = {0.25, 0.25}, e.ridge_height = {0.64, 0.64}; },
     Verdict::undecided, "ridge 0.64 mm comes within 0.050 mm of the limit of 0.60 mm, and the fibres are strained by more than 1e-4"},
    {"strained, far above", [](auto& e) { e.compliant = true, e.ridge_height = {2, 2}; }, Verdict::crease,
     "ridge 2.00 mm exceeds the limit of 0.60 mm"},
    {"not certified", [](auto& e) { e.certified = false; }, Verdict::undecided, "the solution is not certified"},
    {"not certified, with a status", [](auto& e) { e.certified = false, e.solve_status = "iteration limit"; }, Verdict::undecided,
     "the solution is not certified (iteration limit)"},
    {"not certified proves no crease either", [](auto& e) { e.certified = false, e.ridge_height = {9, 9}; }, Verdict::undecided,
     "the solution is not certified"},
    {"deadline", [](auto& e) { e.certified = false, e.deadline_passed = true; }, Verdict::undecided,
     "the deadline passed before the solution was certified"},
    {"deadline, with a status", [](auto& e) { e.certified = false, e.deadline_passed = true, e.solve_status = "stopped"; },
     Verdict::undecided, "the deadline passed before the solution was certified (stopped)"},
    {"deadline between two starts", [](auto& e) { e.deadline_passed = true; }, Verdict::undecided,
     "the deadline passed before all starts that the rule asks for were tried"},
    {"no figures", [](auto& e) { e.rms = {kNan, kNan}; }, Verdict::undecided, "the solution has no finite figures"},
    {"no highest RMS", [](auto& e) { e.rms.high = kNan; }, Verdict::undecided, "the solution has no finite figures"},
    {"no lowest ridge", [](auto& e) { e.ridge_height.low = kNan; }, Verdict::undecided, "the solution has no finite figures"},
    {"no highest bridge", [](auto& e) { e.bridge_height.high = kNan; }, Verdict::undecided,
     "no ridge, RMS 0.26 mm keeps the limit of 0.30 mm, but the ply may bridge the hollow below it: the mold is not known all round"},
    {"no ridge figure", [](auto& e) { e.ridge_height.high = kNan; }, Verdict::undecided, "the solution has no finite figures"},
    {"no bridge figure", [](auto& e) { e.bridge_height.low = kNan; }, Verdict::undecided,
     "no ridge, RMS 0.26 mm keeps the limit of 0.30 mm, but the ply may bridge the hollow below it: the mold is not known all round"},
    {"refused", [](auto& e) { e.refused = "the net has no movable node"; }, Verdict::invalid, "not evaluated: the net has no movable node"},
    {"little seen", [](auto& e) { e.coverage = 0.611; }, Verdict::invalid, "only 61.1 % of the pocket was measured, 80.0 % is needed"},
    {"open rim", [](auto& e) { e.closed_rim = false; }, Verdict::invalid,
     "the rim is not closed by fixed nodes, though the pocket lies inside the ply"},
    {"invalid before crease", [](auto& e) { e.closed_rim = false, e.ridge_height = {3, 3}; }, Verdict::invalid,
     "the rim is not closed by fixed nodes, though the pocket lies inside the ply"},
    {"refused before the deadline", [](auto& e) { e.refused = "too few nodes", e.deadline_passed = true, e.certified = false; },
     Verdict::invalid, "not evaluated: too few nodes"},
};

TEST(Judge, EveryBranch) {
  for (const Case& c : kCases) {
    PocketEvidence evidence = good();
    c.spoil(evidence);
    const Judgement judgement = judge(evidence);
    EXPECT_EQ(name(judgement.verdict), std::string(name(c.verdict))) << c.what;
    EXPECT_EQ(judgement.reason, c.reason) << c.what;
  }
}

TEST(Judge, NeverCeaseWithoutACertificate) {
  EXPECT_EQ(judge(PocketEvidence()).verdict, Verdict::undecided);  // nothing known
  for (double rms = 0; rms < 0.5; rms += 0.01)
    for (double ridge = 0; ridge < 1; ridge += 0.05) {
      PocketEvidence evidence = good();
      evidence.certified = false;
      evidence.rms = {rms, rms};
      evidence.ridge_height = {ridge, ridge};
      EXPECT_EQ(judge(evidence).verdict, Verdict::undecided);
    }
}

TEST(Judge, TakesTheCriteriaItIsGiven) {
  Criteria strict;
  strict.max_rms = 0.26;
  strict.rms_margin = 0;
  EXPECT_EQ(judge(good(), strict).verdict, Verdict::cease);  // at most the limit
  strict.max_rms = 0.2599;
  EXPECT_EQ(judge(good(), strict).verdict, Verdict::crease);
}

TEST(Judge, NamesWhatIsWrong) {
  const auto message = [](const std::function<void(PocketEvidence&, Criteria&)>& spoil) -> std::string {
    PocketEvidence evidence = good();
    Criteria criteria;
    spoil(evidence, criteria);
    try {
      judge(evidence, criteria);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  EXPECT_EQ(message([](auto& e, auto&) { e.rms = {0.4, 0.3}; }).find("rms_range_mm"), 0u);
  EXPECT_EQ(message([](auto& e, auto&) { e.ridge_height = {-0.1, 0.3}; }).find("ridge_range_mm"), 0u);
  EXPECT_EQ(message([](auto& e, auto&) { e.bridge_height = {1, 0}; }).find("bridge_range_mm"), 0u);
  EXPECT_EQ(message([](auto& e, auto&) { e.coverage = 1.2; }).find("coverage"), 0u);
  EXPECT_EQ(message([](auto& e, auto&) { e.coverage = kNan; }).find("coverage"), 0u);
  EXPECT_EQ(message([](auto&, auto& c) { c.max_rms = 0; }).find("max_rms_mm"), 0u);
  EXPECT_EQ(message([](auto&, auto& c) { c.max_ridge_height = kNan; }).find("max_ridge_height_mm"), 0u);
  EXPECT_EQ(message([](auto&, auto& c) { c.min_coverage = 98; }).find("min_coverage"), 0u);
  EXPECT_EQ(message([](auto&, auto& c) { c.min_pocket_coverage = -1; }).find("min_pocket_coverage"), 0u);
  EXPECT_EQ(message([](auto&, auto& c) { c.rms_margin = -1; }).find("rms_margin_mm"), 0u);
  EXPECT_EQ(message([](auto&, auto& c) { c.ridge_margin = kNan; }).find("ridge_margin_mm"), 0u);
  EXPECT_EQ(message([](auto&, auto& c) { c.compliance_margin = -1; }).find("compliance_margin_mm"), 0u);
}

// A pocket inside the ply, certified, whose fibres are hardly too long.
PocketEvidence inside() {
  PocketEvidence evidence = good();
  evidence.inside_ply = true;
  evidence.excess_ridge = Spread{0.2, 0.3};
  return evidence;
}

const Case kByExcess[] = {
    {"as it is", [](auto&) {}, Verdict::cease, "ridge by the excess length 0.20 to 0.30 mm keeps the limit of 0.60 mm"},
    {"neither ridge nor RMS of the minimum counts", [](auto& e) { e.ridge_height = {2, 2}, e.rms = {1, 1}; }, Verdict::cease,
     "ridge by the excess length 0.20 to 0.30 mm keeps the limit of 0.60 mm"},
    {"no excess", [](auto& e) { e.excess_ridge = Spread{0, 0}; }, Verdict::cease, "no ridge by the excess length"},
    {"at the limit", [](auto& e) { e.excess_ridge = Spread{0.3, 0.6}; }, Verdict::cease,
     "ridge by the excess length 0.30 to 0.60 mm keeps the limit of 0.60 mm"},
    {"above", [](auto& e) { e.excess_ridge = Spread{0.61, 0.7}; }, Verdict::crease,
     "ridge by the excess length 0.61 to 0.70 mm exceeds the limit of 0.60 mm"},
    {"on both sides", [](auto& e) { e.excess_ridge = Spread{0.6, 0.7}; }, Verdict::undecided,
     "ridge by the excess length 0.60 to 0.70 mm lies on both sides of the limit of 0.60 mm"},
    {"three decimals where two would show the limit", [](auto& e) { e.excess_ridge = Spread{0.604, 0.7}; }, Verdict::crease,
     "ridge by the excess length 0.604 to 0.700 mm exceeds the limit of 0.600 mm"},
    {"unknown", [](auto& e) { e.excess_ridge.reset(); }, Verdict::undecided, "the excess length is not known"},
    {"not finite", [](auto& e) { e.excess_ridge = Spread{kNan, 0.3}; }, Verdict::undecided, "the excess length is not known"},
    {"nor at the other end", [](auto& e) { e.excess_ridge = Spread{0.3, kNan}; }, Verdict::undecided, "the excess length is not known"},
    {"a bridge counts", [](auto& e) { e.bridge_height = {0.7, 0.9}; }, Verdict::crease,
     "bridge 0.70 to 0.90 mm exceeds the limit of 0.60 mm"},
    {"a low bridge is told", [](auto& e) { e.bridge_height = {0.1, 0.2}; }, Verdict::cease,
     "ridge by the excess length 0.20 to 0.30 mm keeps the limit of 0.60 mm, bridge 0.10 to 0.20 mm keeps the limit of 0.60 mm"},
    {"a bridge's tie", [](auto& e) { e.bridge_height = {0.1, 0.58}; }, Verdict::undecided,
     "bridge 0.10 to 0.58 mm comes within 0.050 mm of the limit of 0.60 mm"},
    {"strained", [](auto& e) { e.compliant = true, e.bridge_height = {0.1, 0.58}; }, Verdict::undecided,
     "bridge 0.10 to 0.58 mm comes within 0.050 mm of the limit of 0.60 mm"},
    {"no minimum is needed", [](auto& e) { e.certified = false; }, Verdict::cease,
     "ridge by the excess length 0.20 to 0.30 mm keeps the limit of 0.60 mm"},
    {"nor for a fibre that is too long", [](auto& e) { e.certified = false, e.excess_ridge = Spread{0.7, 0.8}; }, Verdict::crease,
     "ridge by the excess length 0.70 to 0.80 mm exceeds the limit of 0.60 mm"},
    {"nor near the limit", [](auto& e) { e.deadline_passed = true, e.excess_ridge = Spread{0.5, 0.8}; }, Verdict::undecided,
     "ridge by the excess length 0.50 to 0.80 mm lies on both sides of the limit of 0.60 mm"},
    {"the bridge is not known", [](auto& e) { e.bridge_height = {kNan, kNan}; }, Verdict::undecided,
     "ridge by the excess length 0.20 to 0.30 mm keeps the limit of 0.60 mm, but the ply may bridge the hollow below it: the mold is not "
     "known all round"},
    {"one end of it is not", [](auto& e) { e.bridge_height = {0, kNan}; }, Verdict::undecided,
     "ridge by the excess length 0.20 to 0.30 mm keeps the limit of 0.60 mm, but the ply may bridge the hollow below it: the mold is not "
     "known all round"},
    {"a fibre is too long whatever bridges", [](auto& e) { e.bridge_height = {kNan, kNan}, e.excess_ridge = Spread{0.7, 0.8}; },
     Verdict::crease, "ridge by the excess length 0.70 to 0.80 mm exceeds the limit of 0.60 mm"},
    {"open rim", [](auto& e) { e.closed_rim = false; }, Verdict::invalid,
     "the rim is not closed by fixed nodes, though the pocket lies inside the ply"},
};

TEST(Judge, EveryBranchByTheExcess) {
  for (const Case& c : kByExcess) {
    PocketEvidence evidence = inside();
    c.spoil(evidence);
    const Judgement judgement = judge(evidence);
    EXPECT_EQ(name(judgement.verdict), std::string(name(c.verdict))) << c.what;
    EXPECT_EQ(judgement.reason, c.reason) << c.what;
  }
}

TEST(Judge, SaysWhichCriterionDecided) {
  EXPECT_EQ(judge(inside()).decided_by, Criterion::excess);
  EXPECT_EQ(judge(good()).decided_by, Criterion::paper);  // at the ply's edge
  Criteria paper;
  paper.criterion = Criterion::paper;
  EXPECT_EQ(judge(inside(), paper).decided_by, Criterion::paper);
  PocketEvidence unproven = inside();
  unproven.certified = false;
  unproven.excess_ridge = Spread{0.7, 0.8};
  EXPECT_EQ(judge(unproven).decided_by, Criterion::excess);
}

TEST(Judge, AStrainWidensABridgesMargin) {
  Criteria narrow;
  narrow.ridge_margin = 0.01;
  PocketEvidence evidence = inside();
  evidence.bridge_height = {0.5, 0.57};
  EXPECT_EQ(judge(evidence, narrow).verdict, Verdict::cease);
  evidence.compliant = true;  // by 0.05 mm
  EXPECT_EQ(judge(evidence, narrow).verdict, Verdict::undecided);
  narrow.compliance_margin = 0.02;
  EXPECT_EQ(judge(evidence, narrow).verdict, Verdict::cease);
}

TEST(Judge, AMarginMayBeWiderThanItsLimit) {
  Criteria tight;
  tight.max_ridge_height = 0.04;
  const Judgement judgement = judge(good(), tight);
  EXPECT_EQ(judgement.verdict, Verdict::undecided);
  EXPECT_EQ(judgement.reason, "ridge 0.00 mm comes within 0.050 mm of the limit of 0.04 mm");
  tight = Criteria();
  tight.ridge_margin = 0.01;
  PocketEvidence strained = good();
  strained.rms = {0.1, 0.1};
  strained.ridge_height = {0.57, 0.57};
  EXPECT_EQ(judge(strained, tight).verdict, Verdict::cease);
  strained.compliant = true;
  EXPECT_EQ(judge(strained, tight).verdict, Verdict::undecided);
}

TEST(Judge, TheLimitsOfSharesAndMarginsAreAllowed) {
  Criteria ends;
  ends.min_coverage = ends.min_pocket_coverage = 1;
  ends.rms_margin = ends.ridge_margin = ends.compliance_margin = 0;
  PocketEvidence evidence = good();
  evidence.coverage = 1;
  EXPECT_EQ(judge(evidence, ends).verdict, Verdict::cease);
  EXPECT_EQ(judge_layup({}, 1, ends).verdict, Verdict::cease);
  ends.min_coverage = ends.min_pocket_coverage = 0;
  evidence.coverage = 0;
  EXPECT_EQ(judge(evidence, ends).verdict, Verdict::cease);
  EXPECT_EQ(judge_layup({}, 0, ends).verdict, Verdict::cease);
  ends.min_pocket_coverage = 0.8;
  evidence.coverage = 0.8;  // as much as is needed
  EXPECT_EQ(judge(evidence, ends).verdict, Verdict::cease);
}

TEST(Judge, NamesEveryCriterionThatIsNotPossible) {
  const double inf = std::numeric_limits<double>::infinity();
  const std::pair<double Criteria::*, const char*> lengths[] = {
      {&Criteria::max_rms, "max_rms_mm"},
      {&Criteria::max_ridge_height, "max_ridge_height_mm"},
      {&Criteria::rms_margin, "rms_margin_mm"},
      {&Criteria::ridge_margin, "ridge_margin_mm"},
      {&Criteria::compliance_margin, "compliance_margin_mm"},
  };
  const std::pair<double Criteria::*, const char*> shares[] = {{&Criteria::min_coverage, "min_coverage"},
                                                               {&Criteria::min_pocket_coverage, "min_pocket_coverage"}};
  const auto refused = [](double Criteria::* field, double value) -> std::string {
    Criteria criteria;
    criteria.*field = value;
    try {
      criteria.check();
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  for (const auto& [field, argument] : lengths)
    for (const double value : {-0.01, inf, kNan}) EXPECT_EQ(refused(field, value).find(argument), 0u) << argument << value;
  for (const auto& [field, argument] : shares)
    for (const double value : {-0.01, 1.01, kNan}) EXPECT_EQ(refused(field, value).find(argument), 0u) << argument << value;
  EXPECT_EQ(refused(&Criteria::max_ridge_height, 0).find("max_ridge_height_mm"), 0u);
  PocketEvidence turned = inside();
  turned.excess_ridge = Spread{0.3, 0.2};
  EXPECT_THROW(judge(turned), InputError);
  for (const double coverage : {-0.1, 1.1}) {
    PocketEvidence evidence = good();
    evidence.coverage = coverage;
    EXPECT_THROW(judge(evidence), InputError);
    EXPECT_THROW(judge_layup({}, coverage), InputError);
  }
  Criteria wrong;
  wrong.max_rms = -1;
  EXPECT_THROW(judge_layup({}, 1, wrong), InputError);
}

TEST(Judge, VerdictsHaveNames) {
  EXPECT_EQ(name(Verdict::cease), std::string("cease"));
  EXPECT_EQ(name(Verdict::undecided), std::string("undecided"));
  EXPECT_EQ(name(Verdict::crease), std::string("crease"));
  EXPECT_EQ(name(Verdict::invalid), std::string("invalid"));
}

TEST(JudgeLayup, TakesTheWorstPocket) {
  const JudgedPocket cease{1, {Verdict::cease, "flat"}}, crease{2, {Verdict::crease, "high"}}, also{3, {Verdict::crease, "higher"}};
  const JudgedPocket undecided{4, {Verdict::undecided, "tie"}}, invalid{5, {Verdict::invalid, "open"}};
  const auto check = [](const std::vector<JudgedPocket>& pockets, Verdict verdict, const std::string& reason) {
    const Judgement judgement = judge_layup(pockets, 0.99);
    EXPECT_EQ(judgement.verdict, verdict);
    EXPECT_EQ(judgement.reason, reason);
  };
  check({}, Verdict::cease, "no air pocket, and 99.0 % of the ply was seen");
  check({cease}, Verdict::cease, "1 of 1 pockets cease, pocket 1: flat");
  check({cease, undecided}, Verdict::undecided, "1 of 2 pockets undecided, pocket 4: tie");
  check({undecided, cease, crease, also}, Verdict::crease, "2 of 4 pockets crease, pocket 2: high");
  check({crease, invalid, cease}, Verdict::invalid, "1 of 3 pockets invalid, pocket 5: open");
}

TEST(JudgeLayup, IsInvalidWhereTooLittleWasSeen) {
  EXPECT_EQ(judge_layup({}, 0.98).verdict, Verdict::cease);
  EXPECT_EQ(judge_layup({}, 0.979).verdict, Verdict::invalid);
  EXPECT_EQ(judge_layup({{1, {Verdict::crease, "high"}}}, 0.5).reason, "only 50.0 % of the ply was seen, 98.0 % is needed");
  EXPECT_EQ(judge_layup({}, 0.9799).reason, "only 97.9 % of the ply was seen, 98.0 % is needed");
  EXPECT_THROW(judge_layup({}, kNan), InputError);
  EXPECT_THROW(judge_layup({}, 1.5), InputError);
}

}  // namespace
}  // namespace debulk
