#include "debulk/solve/interior_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "debulk/solve/newton_system.hpp"

namespace debulk {
namespace {

using Eigen::VectorXd;

// Constants of Waechter and Biegler's Algorithm A, with their names.
constexpr double kMuStart = 0.1, kMuFactor = 0.2, kMuPower = 1.5, kMuTest = 10.0, kTauMin = 0.99, kBoundPush = 1e-2;
constexpr double kGammaTheta = 1e-5, kGammaPhi = 1e-8, kEtaPhi = 1e-8, kSTheta = 1.1, kSPhi = 2.3;
constexpr int kCorrections = 4;
constexpr double kAcceptable = 100;  // acceptable error, in tolerances
constexpr int kAcceptableSteps = 15, kPatience = 150;
constexpr double kMostScale = 10;  // of residuals: however large the multipliers are, the certificate has limits
constexpr double kDescent = 1e-2;  // a fall of the energy by this share of it (of at least 1) counts as progress
// Not from that algorithm: a step that would go far, as those of a net without stiffness do, is damped, and cut if
// damping does not help. Lengths are in units of the variables, that is, spacings.
constexpr double kLongest = 1.0, kDamping = 1e-3;
constexpr int kDampings = 4;
// Nor are these, which are for saddles: six convexified steps in a row below this barrier are taken as an approach to a
// saddle. After each escape it takes three more, because it may lead back to the same saddle, which the steps leave, too.
constexpr double kSaddleMu = 1e-3, kEscapeStep = 0.05, kEscapeMu = 1e-4;
constexpr int kSaddleSteps = 6, kMoreSteps = 3, kEscapes = 10;

struct Iterate {
  VectorXd y, lambda, z;  // z: multipliers of the bounds, one per variable, 0 where there is no bound
  VectorXd c;
  double f = 0;
};

class InteriorPoint {
 public:
  InteriorPoint(const Problem& problem, const SolveOptions& options)
      : problem_(problem),
        options_(options),
        n_(problem.variables()),
        m_(problem.equalities()),
        lower_(problem.lower()),
        system_(problem, options.stop) {
    for (int i = 0; i < n_; ++i)
      if (std::isfinite(lower_[i])) bounded_.push_back(i);
  }

  Outcome run(const VectorXd& start) {
    begin(start);
    Outcome outcome;
    outcome.status = iterate(outcome.iterations);
    outcome.y = now_.y;
    for (const int i : bounded_) outcome.y[i] = std::max(outcome.y[i], lower_[i]);
    outcome.evaluations = evaluations_;
    return outcome;
  }

 private:
  void begin(const VectorXd& start) {
    start_ = now_.y = start;
    for (const int i : bounded_) now_.y[i] = std::max(now_.y[i], lower_[i] + kBoundPush);
    now_.z = VectorXd::Zero(n_);
    for (const int i : bounded_) now_.z[i] = 1.0;
    now_.lambda = VectorXd::Zero(m_);
    now_.c.resize(m_);
    evaluate(now_);
    differentiate();
    if (!options_.stop.now()) now_.lambda = system_.fitted_multipliers(gradient_ - now_.z);
    if (!now_.lambda.allFinite() || now_.lambda.lpNorm<Eigen::Infinity>() > 1e3) now_.lambda.setZero();
    const double theta = infeasibility(now_);
    theta_min_ = 1e-4 * std::max(1.0, theta);
    theta_max_ = 1e4 * std::max(1.0, theta);
  }

  SolveStatus iterate(int& iterations) {
    int acceptable = 0, since_best = 0;
    double best = std::numeric_limits<double>::infinity(), lowest = std::numeric_limits<double>::max();
    for (iterations = 0;; ++iterations) {
      const double error = optimality_error(0.0);
      if (error <= options_.tolerance) return SolveStatus::converged;
      // Rounding may be coarser than the tolerance, as it is far from the origin. So the tolerance also counts as met
      // after kAcceptableSteps steps at an acceptable error (Ipopt's acceptable level).
      acceptable = error <= kAcceptable * options_.tolerance ? acceptable + 1 : 0;
      if (acceptable >= kAcceptableSteps) return SolveStatus::converged;
      // A large fall of the energy is progress, too.
      const double height = now_.f + now_.lambda.squaredNorm() / (2 * options_.stiffness);
      since_best = error < 0.9 * best || height < lowest - kDescent * std::max(1.0, std::abs(lowest)) ? 0 : since_best + 1;
      best = std::min(best, error);
      if (since_best == 0) lowest = std::min(lowest, height);
      if (since_best >= kPatience) return SolveStatus::numerical_failure;
      if ((now_.y - start_).lpNorm<Eigen::Infinity>() > problem_.reach()) return SolveStatus::no_minimum;
      if (options_.stop.now()) return options_.stop.cancelled() ? SolveStatus::cancelled : SolveStatus::deadline;
      if (iterations >= options_.max_iterations) return SolveStatus::iteration_limit;
      while (mu_ > options_.tolerance / 10 && optimality_error(mu_) <= kMuTest * mu_) {
        mu_ = std::max(options_.tolerance / 10, std::min(kMuFactor * mu_, std::pow(mu_, kMuPower)));
        filter_.clear();
      }
      if (!step()) {
        if (options_.stop.now()) continue;  // the step was given up because of the stop, which the next round reports
        return SolveStatus::numerical_failure;
      }
      convexified_ = mu_ <= kSaddleMu && system_.convexified() ? convexified_ + 1 : 0;
      if (convexified_ >= kSaddleSteps + kMoreSteps * escapes_ && escapes_ < kEscapes) leave_saddle();
    }
  }

  // Makes one Newton step with its line search. If no step length is acceptable, it tries again with a stronger
  // convexification.
  bool step() {
    system_.assemble(now_.y, now_.lambda);
    system_.spare(mu_ <= kSaddleMu);
    const VectorXd sigma = bound_curvature();
    double at_least = 0;
    for (int attempt = 0; attempt < 6 && !(attempt > 0 && options_.stop.now()); ++attempt) {
      if (!system_.factor(sigma, options_.stiffness, at_least)) return false;
      VectorXd barrier_gradient = gradient_;
      for (const int i : bounded_) barrier_gradient[i] -= mu_ / (now_.y[i] - lower_[i]);
      const VectorXd slope = -(barrier_gradient + system_.jacobian_transposed(now_.lambda));
      const VectorXd deficit = -(now_.c - now_.lambda / options_.stiffness);
      VectorXd dy, dl;
      system_.solve(slope, deficit, dy, dl);
      for (int again = 0; again < kDampings && dy.lpNorm<Eigen::Infinity>() > kLongest; ++again) {
        if (options_.stop.now() || !system_.factor(sigma, options_.stiffness, std::max(kDamping, 8 * system_.shift()))) return false;
        system_.solve(slope, deficit, dy, dl);
      }
      if (dy.allFinite() && dl.allFinite() && search(barrier_gradient, slope, dy, dl)) return true;
      at_least = std::max(10 * system_.last_shift(), 1e-4);
      filter_.clear();
    }
    return false;
  }

  VectorXd bound_curvature() const {
    VectorXd sigma = VectorXd::Zero(n_);
    for (const int i : bounded_) sigma[i] = now_.z[i] / (now_.y[i] - lower_[i]);
    return sigma;
  }

  // Late in the solve, a series of steps that need convexifying leads to a saddle. This steps off it downhill, along
  // the direction of most negative curvature, and lets the barrier grow again so that contacts may open.
  void leave_saddle() {
    system_.assemble(now_.y, now_.lambda);
    VectorXd aside = system_.softest_direction(bound_curvature());
    VectorXd barrier_gradient = gradient_;
    for (const int i : bounded_) barrier_gradient[i] -= mu_ / (now_.y[i] - lower_[i]);
    if (aside.dot(barrier_gradient) > 0) aside = -aside;
    convexified_ = 0;
    ++escapes_;
    const double size = aside.lpNorm<Eigen::Infinity>();
    if (!(size > 0) || !std::isfinite(size)) return;
    aside *= kEscapeStep / size;
    now_.y += longest_step(aside, kTauMin) * aside;
    mu_ = std::max(mu_, kEscapeMu);
    for (const int i : bounded_) now_.z[i] = std::max(now_.z[i], mu_ / (now_.y[i] - lower_[i]));
    evaluate(now_);
    differentiate();
    filter_.clear();
  }

  bool search(const VectorXd& barrier_gradient, const VectorXd& slope, VectorXd dy, VectorXd dl) {
    const double tau = std::max(kTauMin, 1 - mu_);
    const double theta = infeasibility(now_), phi = barrier(now_);
    const double descent = barrier_gradient.dot(dy) + now_.lambda.dot(dl) / options_.stiffness;
    const double longest = std::min(longest_step(dy, tau), kLongest / std::max(kLongest, dy.lpNorm<Eigen::Infinity>()));
    const double rounding = 10 * std::numeric_limits<double>::epsilon() * std::abs(phi);
    double shortest = kGammaTheta;
    if (descent < 0) {
      shortest = std::min(shortest, kGammaPhi * theta / -descent);
      if (theta <= theta_min_) shortest = std::min(shortest, std::pow(theta, kSTheta) / std::pow(-descent, kSPhi));
    }
    shortest = std::max(0.05 * shortest, 1e-12);

    const auto acceptable = [&](const Iterate& trial, double alpha, bool& armijo) {
      const double theta_new = infeasibility(trial), phi_new = barrier(trial);
      if (!std::isfinite(theta_new) || !std::isfinite(phi_new) || theta_new > theta_max_) return false;
      for (const auto& [t, p] : filter_)
        if (theta_new >= t && phi_new >= p) return false;
      armijo = theta <= theta_min_ && descent < 0 && alpha * std::pow(-descent, kSPhi) > std::pow(theta, kSTheta);
      if (armijo) return phi_new <= phi + kEtaPhi * alpha * descent + rounding;
      return theta_new <= (1 - kGammaTheta) * theta || phi_new <= phi - kGammaPhi * theta + rounding;
    };

    Iterate trial;
    double alpha = longest;
    bool armijo = false, accepted = false;
    for (bool first = true; alpha >= shortest; alpha /= 2, first = false) {
      trial = moved(dy, dl, alpha);
      if ((accepted = acceptable(trial, alpha, armijo))) break;
      if (!first || infeasibility(trial) < theta) continue;
      // Second-order corrections: the constraints curve away from the step, so it is aimed at their new values.
      VectorXd c = alpha * (now_.c - now_.lambda / options_.stiffness), dy_c, dl_c;
      double last = theta;
      for (int k = 0; k < kCorrections; ++k) {
        c += trial.c - trial.lambda / options_.stiffness;
        system_.solve(slope, -c, dy_c, dl_c);
        if (!dy_c.allFinite()) break;
        const double alpha_c = longest_step(dy_c, tau);
        trial = moved(dy_c, dl_c, alpha_c);
        if ((accepted = acceptable(trial, alpha, armijo))) {
          dy = dy_c;
          alpha = alpha_c;
          break;
        }
        const double theta_c = infeasibility(trial);
        if (!(theta_c <= 0.99 * last)) break;
        last = theta_c;
      }
      if (accepted) break;
    }
    if (!accepted) return false;
    if (!armijo) filter_.emplace_back((1 - kGammaTheta) * theta, phi - kGammaPhi * theta);
    move_bound_multipliers(dy, tau, trial);
    now_ = std::move(trial);
    differentiate();
    return true;
  }

  Iterate moved(const VectorXd& dy, const VectorXd& dl, double alpha) {
    Iterate to;
    to.y = now_.y + alpha * dy;
    to.lambda = now_.lambda + alpha * dl;
    to.c.resize(m_);
    evaluate(to);
    return to;
  }

  void move_bound_multipliers(const VectorXd& dy, double tau, Iterate& to) {
    VectorXd dz = VectorXd::Zero(n_);
    double alpha = 1;
    for (const int i : bounded_) {
      const double h = now_.y[i] - lower_[i];
      dz[i] = mu_ / h - now_.z[i] - now_.z[i] / h * dy[i];
      if (dz[i] < 0) alpha = std::min(alpha, -tau * now_.z[i] / dz[i]);
    }
    to.z = now_.z + alpha * dz;
    for (const int i : bounded_) {
      const double h = to.y[i] - lower_[i];
      to.z[i] = std::clamp(to.z[i], mu_ / (1e10 * h), 1e10 * mu_ / h);
    }
  }

  double longest_step(const VectorXd& dy, double tau) const {
    double alpha = 1;
    for (const int i : bounded_)
      if (dy[i] < 0) alpha = std::min(alpha, -tau * (now_.y[i] - lower_[i]) / dy[i]);
    return alpha;
  }

  void evaluate(Iterate& at) {
    at.f = problem_.value(at.y);
    problem_.constraints(at.y, at.c);
    ++evaluations_;
  }

  void differentiate() {
    gradient_.resize(n_);
    problem_.gradient(now_.y, gradient_);
    system_.differentiate(now_.y);
  }

  double infeasibility(const Iterate& at) const { return (at.c - at.lambda / options_.stiffness).lpNorm<1>(); }

  double barrier(const Iterate& at) const {
    double sum = at.f + at.lambda.squaredNorm() / (2 * options_.stiffness);
    for (const int i : bounded_) sum -= mu_ * std::log(at.y[i] - lower_[i]);
    return sum;
  }

  double optimality_error(double mu) const {
    const double of_multipliers = now_.lambda.lpNorm<1>() + now_.z.lpNorm<1>();
    const double mean = of_multipliers / std::max(1, m_ + static_cast<int>(bounded_.size()));
    const double scale = std::clamp(mean / 100, 1.0, kMostScale);
    double error = (gradient_ + system_.jacobian_transposed(now_.lambda) - now_.z).lpNorm<Eigen::Infinity>() / scale;
    if (m_ > 0) error = std::max(error, (now_.c - now_.lambda / options_.stiffness).lpNorm<Eigen::Infinity>());
    for (const int i : bounded_) error = std::max(error, std::abs((now_.y[i] - lower_[i]) * now_.z[i] - mu) / scale);
    return error;
  }

  const Problem& problem_;
  SolveOptions options_;
  int n_, m_;
  VectorXd start_, lower_;
  std::vector<int> bounded_;
  NewtonSystem system_;
  Iterate now_;
  VectorXd gradient_;
  double mu_ = kMuStart, theta_min_ = 0, theta_max_ = 0;
  std::vector<std::pair<double, double>> filter_;
  int evaluations_ = 0, convexified_ = 0, escapes_ = 0;
};

}  // namespace

Outcome minimise_with_interior_point(const Problem& problem, const VectorXd& start, const SolveOptions& options) {
  return InteriorPoint(problem, options).run(start);
}

}  // namespace debulk
