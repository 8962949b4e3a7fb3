#include "debulk/verdict/excess_rule.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "debulk/core/error.hpp"
#include "debulk/verdict/judge.hpp"

namespace debulk {
namespace {

ExcessLengths lengths(double at_spacing, double at_half) {
  ExcessLengths out;
  out.at_spacing = at_spacing, out.at_half = at_half;
  out.half_spacing = 3, out.segments = 20;
  return out;
}

TEST(RidgeByExcess, ExtrapolatesToNoSpacing) {
  // What lengths 1 - spacing^2 / 100 say at 6 and 3 mm.
  const ExcessRidge ridge = ridge_by_excess(lengths(1 - 0.36, 1 - 0.09), 0.3, 1.2, 0.02);
  EXPECT_NEAR(ridge.excess, 1, 1e-12);
  EXPECT_NEAR(ridge.height, 0.5 + 0.42920367 * 0.3, 1e-8);
  EXPECT_NEAR(ridge.spacing_error, 0.045, 1e-12);
  EXPECT_NEAR(ridge.range.high - ridge.height, 0.045, 1e-12);  // more than the margin
  EXPECT_EQ(ridge.noise, 0);
}

TEST(RidgeByExcess, KeepsAtLeastTheMargin) {
  const ExcessRidge ridge = ridge_by_excess(lengths(1, 1), 0.3, 1.2, 0.02);
  EXPECT_NEAR(ridge.range.low, ridge.height - 0.02, 1e-12);
  EXPECT_NEAR(ridge.range.high, ridge.height + 0.02, 1e-12);
}

TEST(RidgeByExcess, TakesTheNoisesLengthOff) {
  ExcessLengths noisy = lengths(1 + 0.02 / 4, 1 + 0.02);  // 20 segments of 3 mm, noise of sqrt(0.003) mm
  noisy.noise = std::sqrt(0.003);
  noisy.noise_gain = 0.5;
  const ExcessRidge ridge = ridge_by_excess(noisy, 0.3, 1.2, 0);
  EXPECT_NEAR(ridge.excess, 1, 1e-12);
  EXPECT_NEAR(ridge.noise, std::hypot(0.5 * noisy.noise, ridge.noise_bias) / 2, 1e-12);
  EXPECT_GE(ridge.uncertainty, 2 * ridge.noise);
}

TEST(RidgeByExcess, IsNoRidgeWithinTheConsolidatedPly) {
  EXPECT_EQ(ridge_by_excess(lengths(0.2, 0.2), 0.3, 1.2, 0.02).height, 0);  // 0.23 mm by the formula, 0.25 mm of ply
  EXPECT_GT(ridge_by_excess(lengths(0.25, 0.25), 0.3, 1.2, 0.02).height, 0.25);
  EXPECT_EQ(ridge_by_excess(lengths(0, 0), 0.3, 1.2, 0.02).range.low, 0);
}

TEST(RidgeByExcess, NamesWhatIsWrong) {
  ExcessLengths wrong = lengths(1, 1);
  wrong.half_spacing = 0;
  EXPECT_THROW(ridge_by_excess(wrong, 0.3, 1.2, 0.02), InputError);
  wrong = lengths(1, 1);
  wrong.noise = -1;
  EXPECT_THROW(ridge_by_excess(wrong, 0.3, 1.2, 0.02), InputError);
  EXPECT_THROW(ridge_by_excess(lengths(1, 1), 0.3, 1.2, -0.1), InputError);
  EXPECT_THROW(ridge_by_excess(lengths(std::nan(""), 1), 0.3, 1.2, 0.02), InputError);
}

TEST(RidgeByExcess, SpansBothSpacingsWhereTheyDisagreeByAllThereIs) {
  // A net that folded back on itself at the coarser spacing (765 mm), and one that missed the pocket there.
  for (const auto& [coarse, half] : {std::pair(765.66, 0.32), std::pair(0.0, 1.0), std::pair(1.5, 0.1)}) {
    const ExcessRidge ridge = ridge_by_excess(lengths(coarse, half), 0.3, 1.2, 0.02);
    EXPECT_EQ(ridge.range.low, 0);
    EXPECT_GE(ridge.range.high, ridge_by_excess(lengths(coarse, coarse), 0.3, 1.2, 0).height);
    EXPECT_GE(ridge.range.high, ridge_by_excess(lengths(half, half), 0.3, 1.2, 0).height);
  }
  // Of next to nothing the one may be twice the other, and still nothing creases.
  EXPECT_LT(ridge_by_excess(lengths(0.02, 0.01), 0.3, 1.2, 0.02).range.high, 0.25);
}

// A pocket inside the ply with a certified minimum that would crease by its RMS.
PocketEvidence inside(double low, double high) {
  PocketEvidence evidence;
  evidence.inside_ply = true;
  evidence.excess_ridge = Spread{low, high};
  evidence.rms = {0.4, 0.4};
  evidence.certified = true;
  return evidence;
}

TEST(JudgeByExcess, DecidesInsideThePly) {
  const Judgement high = judge(inside(0.61, 0.65)), low = judge(inside(0.5, 0.54)), both = judge(inside(0.58, 0.62));
  EXPECT_EQ(high.verdict, Verdict::crease);
  EXPECT_EQ(high.reason, "ridge by the excess length 0.61 to 0.65 mm above the limit of 0.60 mm");
  EXPECT_EQ(high.decided_by, Criterion::excess);
  EXPECT_EQ(low.verdict, Verdict::cease);
  EXPECT_EQ(both.verdict, Verdict::undecided);
  EXPECT_EQ(both.reason, "ridge by the excess length 0.58 to 0.62 mm lies on both sides of the limit of 0.60 mm");
}

TEST(JudgeByExcess, LeavesThePlysEdgeAndThePapersCriterionToTheMinima) {
  PocketEvidence edge = inside(0.1, 0.2);
  edge.inside_ply = false;
  EXPECT_EQ(judge(edge).verdict, Verdict::crease);
  EXPECT_EQ(judge(edge).decided_by, Criterion::paper);
  Criteria paper;
  paper.criterion = Criterion::paper;
  EXPECT_EQ(judge(inside(0.1, 0.2), paper).verdict, Verdict::crease);
}

TEST(JudgeByExcess, CreaseNeedsNoMinimumButCeaseDoes) {
  PocketEvidence evidence = inside(0.7, 0.74);
  evidence.certified = false;
  EXPECT_EQ(judge(evidence).verdict, Verdict::crease);
  evidence.excess_ridge = Spread{0.3, 0.34};
  EXPECT_EQ(judge(evidence).verdict, Verdict::undecided);
  EXPECT_NE(judge(evidence).reason.find("may bridge: the solution is not certified"), std::string::npos);
  evidence.no_bridge = true;  // but not where nothing can bridge
  EXPECT_EQ(judge(evidence).verdict, Verdict::cease);
}

TEST(JudgeByExcess, ABridgeIsNoExcess) {
  PocketEvidence evidence = inside(0.3, 0.34);
  evidence.bridge_height = {0.9, 0.9};
  EXPECT_EQ(judge(evidence).verdict, Verdict::crease);
  EXPECT_EQ(judge(evidence).reason, "bridge 0.90 mm above the limit of 0.60 mm");
}

TEST(JudgeByExcess, ACertifiedBridgeOutweighsTheBoundOnBridges) {
  PocketEvidence evidence = inside(0.3, 0.34);
  evidence.no_bridge = true;
  evidence.bridge_height = {0.5, 0.54};
  EXPECT_EQ(judge(evidence).verdict, Verdict::cease);
  EXPECT_EQ(judge(evidence).reason.find("bridge"), std::string::npos);
  evidence.bridge_height = {0.5, 0.57};  // within the margin of the limit
  EXPECT_EQ(judge(evidence).verdict, Verdict::undecided);
  evidence.bridge_height = {0.9, 0.9};
  EXPECT_EQ(judge(evidence).verdict, Verdict::crease);
  evidence.certified = false;  // such a minimum proves nothing
  EXPECT_EQ(judge(evidence).verdict, Verdict::cease);
}

TEST(JudgeByExcess, WithoutTheExcessNothingIsDecided) {
  PocketEvidence evidence = inside(0, 0);
  evidence.excess_ridge.reset();
  EXPECT_EQ(judge(evidence).verdict, Verdict::undecided);
  EXPECT_FALSE(judge(evidence).decided_by.has_value());
}

TEST(JudgeByExcess, InvalidComesFirst) {
  PocketEvidence evidence = inside(0.7, 0.74);
  evidence.closed_rim = false;
  EXPECT_EQ(judge(evidence).verdict, Verdict::invalid);
}

}  // namespace
}  // namespace debulk
