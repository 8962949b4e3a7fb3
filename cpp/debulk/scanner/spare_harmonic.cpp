#include "debulk/scanner/spare_harmonic.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>

#include <Eigen/Dense>

namespace debulk {
namespace {

constexpr std::size_t segment = 256;  // pixels that are fitted together
constexpr int highest = 18;           // multiple of the phase; the harmonics of a gamma of 0.45 are below 0.4 % from here on
constexpr double pi = 3.14159265358979323846;

}  // namespace

SpareHarmonic::SpareHarmonic(int step_count, int period_count) : steps(step_count), periods(period_count), multiples{1} {
  const int harmonic = steps == 3 ? 0 : steps / 2;
  for (int k = 0; k < steps; ++k) {
    cosine.push_back(std::cos(2 * pi * k / steps)), sine.push_back(std::sin(2 * pi * k / steps));
    weights.push_back(std::cos(2 * pi * harmonic * k / steps));  // alternating for even numbers of steps
  }
  double squares = 0;
  for (double w : weights) squares += w * w;
  for (double& w : weights) w /= std::sqrt(steps == 3 ? 2 * squares : squares);
  for (int n = 2; n <= highest; ++n)
    if (n % steps == harmonic || (n + harmonic) % steps == 0) multiples.push_back(n);
}

void SpareSegment::add(const double* values, std::vector<LevelVariance>& out) {
  const SpareHarmonic& how = *how_;
  const int images = how.steps * how.periods;
  // Grey values are cut off at zero. A pixel that is dark in so many images shows less than its noise.
  if (4 * std::count(values, values + images, 0.0) > images) return;
  double total = 0;
  for (int p = 0; p < how.periods; ++p) {
    Fringe fringe{};
    for (int k = 0; k < how.steps; ++k) {
      const double v = values[p * how.steps + k];
      const std::size_t at = static_cast<std::size_t>(k);
      total += v, fringe.c += v * how.cosine[at], fringe.s -= v * how.sine[at], fringe.spare += v * how.weights[at];
    }
    fringe.c *= 2.0 / how.steps, fringe.s *= 2.0 / how.steps;
    fringes_.push_back(fringe);
  }
  level_.push_back(total / images);
  values_.insert(values_.end(), values, values + images);
  if (level_.size() == segment) fit(out);
}

void SpareSegment::finish(std::vector<LevelVariance>& out) {
  const std::size_t terms = 1 + 2 * how_->multiples.size() * (how_->steps == 3 ? 2 : 1);
  if (level_.size() >= 3 * terms) fit(out);
}

void SpareSegment::fit(std::vector<LevelVariance>& out) {
  const std::size_t count = level_.size(), periods = static_cast<std::size_t>(how_->periods);
  const std::size_t sets = how_->steps == 3 ? 2 : 1;  // numbers of periods in one combination
  const std::size_t each = 2 * how_->multiples.size(), terms = 1 + sets * each;
  const double brightest = *std::max_element(level_.begin(), level_.end());
  Eigen::MatrixXd design(terms, count), slope = Eigen::MatrixXd::Zero(terms, count);
  Eigen::VectorXd value(count), weight(count);
  std::vector<LevelVariance> sums(count);
  std::vector<double> share(count, 0);  // of the variance of a grey value that the residuals have
  for (std::size_t i = 0; i < count; ++i) weight(i) = 1 / std::sqrt(level_[i] + 0.01 * brightest);  // the noise of light

  for (std::size_t p = 0; p + sets <= (sets == 2 ? 2 : periods); ++p) {
    for (std::size_t i = 0; i < count; ++i) {
      const Fringe* fringe = &fringes_[i * periods + p];
      value(i) = fringe[0].spare - (sets == 2 ? fringe[1].spare : 0);
      design(0, i) = level_[i];
      for (std::size_t set = 0; set < sets; ++set) {
        const std::complex<double> light(fringe[set].c, fringe[set].s);
        const double modulation = std::abs(light);
        const std::complex<double> turn = modulation > 0 ? light / modulation : 1.0;
        std::complex<double> power = 1;
        int reached = 0;
        for (std::size_t j = 0; j < how_->multiples.size(); ++j) {
          while (reached < how_->multiples[j]) power *= turn, ++reached;
          const std::size_t at = 1 + set * each + 2 * j;
          design(at, i) = modulation * power.real(), design(at + 1, i) = modulation * power.imag();
          slope(at, i) = reached * -power.imag(), slope(at + 1, i) = reached * power.real();
        }
      }
    }
    const Eigen::MatrixXd weighted = design * weight.asDiagonal();
    Eigen::MatrixXd normal = weighted * weighted.transpose();
    normal.diagonal().array() += 1e-9 * normal.trace();  // fringes along the rows do not tell the terms apart
    const Eigen::LLT<Eigen::MatrixXd> factor(normal);
    const Eigen::VectorXd found = factor.solve(weighted * weight.cwiseProduct(value));
    const Eigen::VectorXd leverage = factor.matrixL().solve(weighted).colwise().squaredNorm();
    const Eigen::VectorXd rest = value - design.transpose() * found;
    for (std::size_t i = 0; i < count; ++i) {
      // A grey value's noise enters the residual by its weight in the combination, and by the fringes to which the
      // fitted value belongs. With gamma, both are alike in size.
      const double kept = std::max(1 - leverage(i), 0.1);
      sums[i].variance += rest(i) * rest(i) / kept;
      for (std::size_t set = 0; set < sets; ++set) {
        const std::size_t at = 1 + set * each;
        const Fringe& fringe = fringes_[i * periods + p + set];
        const double modulation = std::max(std::hypot(fringe.c, fringe.s), 1e-9);
        const double outward = found.segment(at, each).dot(design.col(i).segment(at, each)) / modulation;
        const double across = found.segment(at, each).dot(slope.col(i).segment(at, each));
        const double by_c = (outward * fringe.c - across * fringe.s) / modulation;
        const double by_s = (outward * fringe.s + across * fringe.c) / modulation;
        for (std::size_t k = 0; k < static_cast<std::size_t>(how_->steps); ++k) {
          const double moved = 2.0 / how_->steps * (by_c * how_->cosine[k] - by_s * how_->sine[k]);
          const double by_value = (set == 0 ? how_->weights[k] : -how_->weights[k]) - moved, square = by_value * by_value;
          share[i] += square, sums[i].level += square * values_[(i * periods + p + set) * static_cast<std::size_t>(how_->steps) + k];
        }
      }
    }
  }
  for (std::size_t i = 0; i < count; ++i) out.push_back({sums[i].level / share[i], sums[i].variance / share[i]});
  level_.clear(), fringes_.clear(), values_.clear();
}

}  // namespace debulk
