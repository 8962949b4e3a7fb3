#include "debulk/solve/nlopt.hpp"

#include <nlopt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

namespace debulk {
namespace {

using Eigen::VectorXd;

constexpr double kReach = 1e-6;  // smallest slope that can be asked of a gradient method
constexpr double kWeightFirst = 10, kWeightMost = 1e6, kWeightFactor = 10;
constexpr double kAcceptable = 5e-5;  // slope and violation up to which it counts as converged when it makes no more progress
constexpr int kPatience = 8;
constexpr unsigned kMemory = 50;    // pairs that L-BFGS keeps
constexpr int kEvaluations = 3000;  // most evaluations in one minimisation

// The augmented Lagrangian of the elastic problem with its slacks s eliminated, that is, the minimum over s of
//   f(y) + k/2 |s|^2 + lambda . (c - s) + w/2 |c - s|^2,  at s = (lambda + w c) / (k + w),
// which leaves f + lambda . c + w/2 |c|^2 - |lambda + w c|^2 / (2 (k + w)), with tensions k s as its derivative by c.
class AugmentedLagrangian {
 public:
  AugmentedLagrangian(const Problem& problem, const SolveOptions& options)
      : problem_(problem),
        options_(options),
        lower_(problem.lower()),
        pattern_(problem.jacobian_pattern()),
        jacobian_(static_cast<long>(pattern_.size())),
        slope_(problem.variables()),
        c_(problem.equalities()),
        tension_(problem.equalities()),
        lambda_(VectorXd::Zero(problem.equalities())) {}

  Outcome run(const VectorXd& start) {
    Outcome outcome;
    outcome.y = start.cwiseMax(lower_);
    const double slope_tolerance = std::max(kReach, options_.tolerance);
    double last = std::numeric_limits<double>::infinity(), least = last;
    int stalled = 0;
    for (outcome.status = SolveStatus::iteration_limit; outcome.iterations < options_.max_iterations && !options_.stop.now();) {
      within_ = std::max(slope_tolerance / 2, 1e-2 * std::pow(0.1, outcome.iterations));
      minimise(outcome.y);
      ++outcome.iterations;
      at(outcome.y);
      const double missing = c_.size() ? (c_ - tension_ / options_.stiffness).lpNorm<Eigen::Infinity>() : 0.0;
      const double slope = projected_slope(outcome.y);
      stalled = std::max(missing, slope) < 0.9 * least ? 0 : stalled + 1;
      least = std::min(least, std::max(missing, slope));
      if (missing <= options_.tolerance && slope <= slope_tolerance) {
        outcome.status = SolveStatus::converged;
        break;
      }
      if (!std::isfinite(missing + slope) || stalled >= kPatience) {
        outcome.status = missing <= kAcceptable && slope <= kAcceptable ? SolveStatus::converged : SolveStatus::numerical_failure;
        break;
      }
      lambda_ = tension_;
      if (missing > 0.25 * last) weight_ = std::min(kWeightMost, kWeightFactor * weight_);
      last = missing;
    }
    if (outcome.status != SolveStatus::converged && options_.stop.now())
      outcome.status = options_.stop.cancelled() ? SolveStatus::cancelled : SolveStatus::deadline;
    outcome.evaluations = evaluations_;
    return outcome;
  }

 private:
  // Returns the value at y and sets slope_.
  double at(const VectorXd& y) {
    ++evaluations_;
    const double k = options_.stiffness, f = problem_.value(y);
    problem_.constraints(y, c_);
    problem_.gradient(y, slope_);
    problem_.jacobian(y, jacobian_);
    const VectorXd pull = lambda_ + weight_ * c_;
    tension_ = k / (k + weight_) * pull;
    for (std::size_t e = 0; e < pattern_.size(); ++e)
      slope_[pattern_[e].column] += jacobian_[static_cast<long>(e)] * tension_[pattern_[e].row];
    return f + lambda_.dot(c_) + weight_ / 2 * c_.squaredNorm() - pull.squaredNorm() / (2 * (k + weight_));
  }

  double projected_slope(const VectorXd& y) const { return (y - (y - slope_).cwiseMax(lower_)).lpNorm<Eigen::Infinity>(); }

  // NLopt has no tolerance on the slope, so a point that meets ours is kept and the run is stopped here.
  static double evaluate(unsigned n, const double* y, double* slope, void* self_and_optimiser) {
    const auto& [self, optimiser] = *static_cast<std::pair<AugmentedLagrangian*, nlopt_opt>*>(self_and_optimiser);
    self->point_ = Eigen::Map<const VectorXd>(y, n);
    const double value = self->at(self->point_);
    if (slope) Eigen::Map<VectorXd>(slope, n) = self->slope_;
    const bool reached = self->projected_slope(self->point_) <= self->within_;
    if (reached) self->found_ = self->point_;
    if (reached || self->options_.stop.now()) nlopt_force_stop(optimiser);
    return value;
  }

  // Improves y in place. NLopt's own status is of little use; the next round shows whether y has converged.
  void minimise(VectorXd& y) {
    const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> optimiser(nlopt_create(NLOPT_LD_LBFGS, static_cast<unsigned>(y.size())),
                                                                      nlopt_destroy);
    std::pair<AugmentedLagrangian*, nlopt_opt> data(this, optimiser.get());
    nlopt_set_min_objective(optimiser.get(), evaluate, &data);
    nlopt_set_lower_bounds(optimiser.get(), lower_.data());
    nlopt_set_vector_storage(optimiser.get(), kMemory);
    nlopt_set_maxeval(optimiser.get(), kEvaluations);
    found_.resize(0);
    double value = 0;
    nlopt_optimize(optimiser.get(), y.data(), &value);
    if (found_.size()) y = found_;
  }

  const Problem& problem_;
  const SolveOptions& options_;
  VectorXd lower_;
  std::vector<Problem::Entry> pattern_;
  VectorXd jacobian_, slope_, c_, tension_, lambda_;
  VectorXd point_, found_;
  double weight_ = kWeightFirst, within_ = 0;
  int evaluations_ = 0;
};

}  // namespace

Outcome minimise_with_nlopt(const Problem& problem, const VectorXd& start, const SolveOptions& options) {
  return AugmentedLagrangian(problem, options).run(start);
}

}  // namespace debulk
