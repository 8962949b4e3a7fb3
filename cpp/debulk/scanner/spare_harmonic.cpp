#include "debulk/scanner/spare_harmonic.hpp"

#include <algorithm>
#include <cmath>
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
  using Eigen::ArrayXd, Eigen::Index, Eigen::VectorXd;
  using Strided = Eigen::Map<const ArrayXd, 0, Eigen::InnerStride<>>;
  const auto count = static_cast<Index>(level_.size()), periods = static_cast<Index>(how_->periods),
             steps = static_cast<Index>(how_->steps);
  const Index sets = how_->steps == 3 ? 2 : 1;  // numbers of periods in one combination
  const Index each = 2 * static_cast<Index>(how_->multiples.size()), terms = 1 + sets * each;
  const Eigen::Map<const ArrayXd> level(level_.data(), count);
  const ArrayXd weight = 1 / (level + 0.01 * level.maxCoeff()).sqrt();  // the noise of light
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> design(terms, count);
  design.row(0) = level;
  ArrayXd variance = ArrayXd::Zero(count), mean = ArrayXd::Zero(count);
  ArrayXd share = ArrayXd::Zero(count);  // of the variance of a grey value that the residuals have

  for (Index p = 0; p + sets <= (sets == 2 ? 2 : periods); ++p) {
    const auto part = [&](double Fringe::* which, Index set) {
      return Strided(&(fringes_[static_cast<std::size_t>(p + set)].*which), count, Eigen::InnerStride<>(3 * periods));
    };
    ArrayXd modulation[2];
    for (Index set = 0; set < sets; ++set) {
      const auto c = part(&Fringe::c, set), s = part(&Fringe::s, set);
      modulation[set] = (c.square() + s.square()).sqrt().max(1e-9);
      const ArrayXd turn_c = c / modulation[set], turn_s = s / modulation[set];
      ArrayXd power_c = turn_c, power_s = turn_s;
      Index row = 1 + set * each;
      int reached = 1;
      for (const int multiple : how_->multiples) {
        for (; reached < multiple; ++reached) {
          const ArrayXd next = power_c * turn_c - power_s * turn_s;
          power_s = power_c * turn_s + power_s * turn_c, power_c = next;
        }
        design.row(row++) = modulation[set] * power_c, design.row(row++) = modulation[set] * power_s;
      }
    }
    VectorXd value = part(&Fringe::spare, 0);
    if (sets == 2) value.array() -= part(&Fringe::spare, 1);
    const auto weighted = (design * weight.matrix().asDiagonal()).eval();
    Eigen::MatrixXd normal = weighted * weighted.transpose();
    normal.diagonal().array() += 1e-9 * normal.trace();  // fringes along the rows do not tell the terms apart
    const Eigen::LLT<Eigen::MatrixXd> factor(normal);
    const VectorXd found = factor.solve(weighted * (weight * value.array()).matrix());
    const ArrayXd leverage = factor.matrixL().solve(weighted).colwise().squaredNorm();
    const ArrayXd rest = value - design.transpose() * found;
    variance += rest.square() / (1 - leverage).max(0.1);
    for (Index set = 0; set < sets; ++set) {
      // A grey value's noise enters the residual by its weight in the combination, and by the fringes to which the
      // fitted value belongs. With gamma, both are alike in size.
      const auto c = part(&Fringe::c, set), s = part(&Fringe::s, set);
      const auto own = design.middleRows(1 + set * each, each);
      const VectorXd by_size = found.segment(1 + set * each, each);
      VectorXd by_turn(each);
      for (Index j = 0; j < each; j += 2) {
        const int multiple = how_->multiples[static_cast<std::size_t>(j / 2)];
        by_turn(j) = multiple * by_size(j + 1), by_turn(j + 1) = -multiple * by_size(j);
      }
      const ArrayXd square = modulation[set].square(), outward = own.transpose() * by_size, across = own.transpose() * by_turn;
      const ArrayXd by_c = (outward * c - across * s) / square, by_s = (outward * s + across * c) / square;
      for (Index k = 0; k < steps; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double own_weight = set == 0 ? how_->weights[at] : -how_->weights[at], of_c = 2 * how_->cosine[at], of_s = 2 * how_->sine[at];
        const ArrayXd by_value = (own_weight - (of_c * by_c - of_s * by_s) / static_cast<double>(steps)).square();
        share += by_value, mean += by_value * Strided(&values_[static_cast<std::size_t>((p + set) * steps + k)], count,
                                                      Eigen::InnerStride<>(periods * steps));
      }
    }
  }
  for (Index i = 0; i < count; ++i) out.push_back({mean(i) / share(i), variance(i) / share(i)});
  level_.clear(), fringes_.clear(), values_.clear();
}

}  // namespace debulk
