#include "debulk/section/fold.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

#include "debulk/core/error.hpp"
#include "debulk/section/balance.hpp"
#include "debulk/section/frame.hpp"
#include "debulk/section/problem.hpp"
#include "debulk/section/start.hpp"
#include "debulk/solve/interior_point.hpp"

namespace debulk {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeastExcess = 1e-3;               // in natural lengths
constexpr double kShortest = 0.0075, kInFold = 10;  // shortest segment, in natural lengths; least number of segments in a fold
constexpr double kTouching_mm = Certificate::penetration_limit_mm;

// Returns the arc length of a small fold, mm (docs/model.md, section 6).
double lifted_length(double excess, double natural) {
  return 4.844 * natural * std::pow(excess / natural, 1.0 / 7);
}

// Returns a unit of length between the height of a small fold, which varies as the power 4/7 of its excess, and the
// natural length of a large one.
double unit_of_length(double excess, double natural) {
  return natural * std::pow(std::min(1.0, excess / natural), 0.4);
}

void check_lengths(double excess, double span, double natural) {
  require(std::isfinite(span) && span > 0, "span_mm", "a positive length in mm", span);
  require(std::isfinite(excess) && excess > 0, "excess_length_mm", "a positive length in mm", excess);
  require(excess <= span, "excess_length_mm", "at most span_mm", excess);
  std::ostringstream least;
  least << kLeastExcess * natural << " mm or more, a thousandth of the natural length (below, the closed form is right)";
  require(excess >= kLeastExcess * natural, "excess_length_mm", least.str().c_str(), excess);
}

// Requires segments long enough for their forces to exceed the rounding errors, and short enough to bend into the fold.
// Lengths are in mm.
void check_resolution(const Eigen::VectorXd& lengths, double lifted, double natural, int segments) {
  const double shortest = kShortest * natural, longest = lifted / kInFold;
  std::ostringstream expected;
  expected << std::ceil(lengths.sum() / longest) << " to " << std::floor(lengths.sum() / shortest) << " for a ply " << lengths.sum()
           << " mm long and a natural length of " << natural << " mm";
  require(lengths.minCoeff() >= shortest && lengths.maxCoeff() <= longest, "segments", expected.str().c_str(), segments);
}

// Solves one fold under rising pressure.
class LoadPath {
 public:
  LoadPath(SectionProblem problem, const SectionFrame& frame, double pressure, const SectionOptions& options)
      : problem_(std::move(problem)), frame_(frame), pressure_(pressure), solve_(options.solve) {
    solve_.tolerance = std::max(solve_.tolerance, problem_.rounding());
    fold_.natural_length = frame.unit * problem_.energy().natural_length();
  }

  // Solves at a share of the pressure; returns false if that did not give a certified single fold.
  bool step(double share, const Eigen::VectorXd& start) {
    problem_.set_pressure(share);
    const Outcome outcome = minimise_with_interior_point(problem_, start, solve_);
    y_ = outcome.y;
    fold_.status = outcome.status;
    fold_.certificate = Certificate();
    fold_.certificate.kkt_error = fold_.certificate.strict_kkt_error = kNaN;
    fold_.folds = 0;
    fold_.guide_force = kNaN;
    step_ = {share * pressure_, kNaN, kNaN, kNaN, step_.iterations + outcome.iterations};
    if (outcome.status != SolveStatus::converged) return false;

    const SectionBalance balance = balance_section(problem_, y_, kTouching_mm / frame_.unit);
    fold_.certificate = balance.certificate;
    fold_.certificate.penetration_mm *= frame_.unit;
    fold_.folds = balance.folds;
    if (!fold_.certified()) return false;
    const double force = pressure_ * frame_.unit;
    step_.height = frame_.unit * balance.height;
    step_.foot_width = frame_.unit * balance.foot_width;
    step_.end_force = force * balance.end_force;
    fold_.guide_force = force * balance.guide_force;
    return true;
  }

  void end_step() { fold_.steps.push_back(std::exchange(step_, SectionStep())); }
  bool stopped() const { return solve_.stop.now(); }
  const SectionProblem& problem() const { return problem_; }
  const Eigen::VectorXd& last() const { return y_; }

  SectionFold result() const {
    SectionFold out = fold_;
    const Eigen::Matrix2Xd line = problem_.to_line(y_);
    for (long i = 0; i < line.cols(); ++i) out.points.push_back(frame_.out_of(line.col(i)));
    return out;
  }

 private:
  SectionProblem problem_;
  SectionFrame frame_;
  double pressure_;  // MPa, the full pressure
  SolveOptions solve_;
  Eigen::VectorXd y_;
  SectionStep step_;
  SectionFold fold_;
};

}  // namespace

void SectionOptions::check() const {
  require(segments >= 16 && segments <= 100000 && segments % 2 == 0, "segments", "an even number from 16 to 100000", segments);
  require(steps >= 1 && steps <= 1000, "steps", "1 to 1000", steps);
  require(pressure == "following" || pressure == "vertical", "pressure", "\"following\" or \"vertical\"", '"' + pressure + '"');
  require(bending == "consistent" || bending == "paper", "bending", "\"consistent\" or \"paper\"", '"' + bending + '"');
  require(std::isfinite(contact_distance) && contact_distance >= 0, "contact_distance_mm", "0 mm or more", contact_distance);
  solve.check();
}

void SectionPly::check() const {
  require(std::isfinite(stiffness) && stiffness > 0, "stiffness_n_mm", "a positive bending stiffness", stiffness);
  require(std::isfinite(pressure) && pressure > 0, "pressure_mpa", "a positive pressure", pressure);
}

double section_stiffness(const SectionPly& ply, const SectionOptions& options) {
  return options.bending == "paper" ? ply.stiffness * 2 / options.segments : ply.stiffness;
}

std::string SectionFold::explanation() const {
  if (status != SolveStatus::converged) return debulk::explanation(status);
  if (!certificate.certified()) return certificate.failure();
  if (folds != 1) return "the ply stands off the mold in " + std::to_string(folds) + " places instead of one fold";
  return "one fold, certified";
}

SectionFold fold_section(double excess, double span, const SectionPly& ply, const std::vector<Eigen::Vector2d>& profile,
                         const SectionOptions& options) {
  ply.check();
  options.check();
  const double natural = std::cbrt(section_stiffness(ply, options) / ply.pressure);
  check_lengths(excess, span, natural);
  const SectionFrame frame = section_frame(span, unit_of_length(excess, natural), profile);
  const SectionProfile mold = section_mold(frame, profile);
  const auto bump_under = [&](double share) {
    const double arc = lifted_length(excess, natural / std::cbrt(share));
    return section_start(mold, frame.half_span, excess / frame.unit, options.segments, arc / frame.unit);
  };
  const SectionStart start = bump_under(1.0 / options.steps);
  check_resolution(frame.unit * start.lengths, lifted_length(excess, natural), natural, options.segments);

  const auto kind = options.pressure == "following" ? SectionEnergy::Pressure::following : SectionEnergy::Pressure::vertical;
  const auto flanks = options.self_contact ? std::optional<double>(options.contact_distance / frame.unit) : std::nullopt;
  const SectionEnergy energy(start.lengths, natural / frame.unit, kind, frame.up());
  LoadPath path(SectionProblem(mold, start.lengths, start.line, energy, flanks), frame, ply.pressure, options);
  bool standing = true;
  for (int k = 1; k <= options.steps && standing; ++k) {
    const double share = static_cast<double>(k) / options.steps;
    standing = path.step(share, k == 1 ? path.problem().start() : path.last());
    // The last step's fold may not lead to a single fold (a dead load on a wide arch presses its crown in). Then try
    // again from a bump made for this load.
    if (!standing && k > 1 && !path.stopped()) standing = path.step(share, path.problem().from_line(bump_under(share).line));
    path.end_step();
  }
  return path.result();
}

}  // namespace debulk
