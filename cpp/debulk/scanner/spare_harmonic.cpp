#include "debulk/scanner/spare_harmonic.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Dense>

namespace debulk {
namespace {

constexpr int segment = 256;          // pixels that are fitted together
constexpr int highest = 18;           // multiple of the phase; the harmonics of a gamma of 0.45 are below 0.4 % from here on
constexpr double least_contrast = 5;  // a lit pixel's modulation exceeds this many standard deviations of a grey value
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

SpareSegment::SpareSegment(const SpareHarmonic& how)
    : how_(&how), values_(static_cast<std::size_t>(how.steps * how.periods) * static_cast<std::size_t>(segment)) {}

void SpareSegment::add(const double* values, std::vector<LevelVariance>& out) {
  const int images = how_->steps * how_->periods;
  // Grey values are cut off at zero. A pixel that is dark in so many images shows less than its noise.
  if (4 * std::count(values, values + images, 0.0) > images) return;
  for (int k = 0; k < images; ++k) values_[static_cast<std::size_t>(k * segment + count_)] = values[k];
  if (++count_ == segment) fit(out);
}

void SpareSegment::finish(std::vector<LevelVariance>& out) {
  const int terms = 1 + 2 * static_cast<int>(how_->multiples.size()) * (how_->steps == 3 ? 2 : 1);
  if (count_ >= 3 * terms) fit(out);
}

void SpareSegment::fit(std::vector<LevelVariance>& out) {
  using Eigen::ArrayXd, Eigen::Index, Eigen::VectorXd;
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const Index count = count_, periods = how_->periods, steps = how_->steps;
  const Index sets = how_->steps == 3 ? 2 : 1;  // numbers of periods in one combination
  const Index each = 2 * static_cast<Index>(how_->multiples.size()), terms = 1 + sets * each;
  const Eigen::Map<const Rows, 0, Eigen::OuterStride<>> values(values_.data(), periods * steps, count, Eigen::OuterStride<>(segment));
  const ArrayXd level = values.colwise().mean();
  const ArrayXd weight = 1 / (level + 0.01 * level.maxCoeff()).sqrt();  // the noise of light
  Rows design(terms, count);
  design.row(0) = level;
  ArrayXd variance = ArrayXd::Zero(count), mean = ArrayXd::Zero(count);
  ArrayXd share = ArrayXd::Zero(count);  // of the variance of a grey value that the residuals have
  ArrayXd weakest = ArrayXd::Constant(count, std::numeric_limits<double>::infinity());  // the least modulation

  for (Index p = 0; p + sets <= (sets == 2 ? 2 : periods); ++p) {
    const auto sum = [&](const std::vector<double>& factors, Index set) -> ArrayXd {
      return values.middleRows((p + set) * steps, steps).transpose() * Eigen::Map<const VectorXd>(factors.data(), steps);
    };
    ArrayXd c[2], s[2];  // modulation times cosine and sine of the phase
    ArrayXd modulation[2];
    for (Index set = 0; set < sets; ++set) {
      c[set] = sum(how_->cosine, set) * (2.0 / how_->steps), s[set] = sum(how_->sine, set) * (-2.0 / how_->steps);
      modulation[set] = (c[set].square() + s[set].square()).sqrt().max(1e-9);
      weakest = weakest.min(modulation[set]);
      const ArrayXd turn_c = c[set] / modulation[set], turn_s = s[set] / modulation[set];
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
    VectorXd value = sum(how_->weights, 0);
    if (sets == 2) value.array() -= sum(how_->weights, 1);
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
      const auto own = design.middleRows(1 + set * each, each);
      const VectorXd by_size = found.segment(1 + set * each, each);
      VectorXd by_turn(each);
      for (Index j = 0; j < each; j += 2) {
        const int multiple = how_->multiples[static_cast<std::size_t>(j / 2)];
        by_turn(j) = multiple * by_size(j + 1), by_turn(j + 1) = -multiple * by_size(j);
      }
      const ArrayXd square = modulation[set].square(), outward = own.transpose() * by_size, across = own.transpose() * by_turn;
      const ArrayXd by_c = (outward * c[set] - across * s[set]) / square, by_s = (outward * s[set] + across * c[set]) / square;
      for (Index k = 0; k < steps; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double own_weight = set == 0 ? how_->weights[at] : -how_->weights[at], of_c = 2 * how_->cosine[at], of_s = 2 * how_->sine[at];
        const ArrayXd by_value = (own_weight - (of_c * by_c - of_s * by_s) / static_cast<double>(steps)).square();
        share += by_value, mean += by_value * values.row((p + set) * steps + k).transpose().array();
      }
    }
  }
  // A pixel that no fringe lights has a phase of noise, which the fitted terms follow: it would show a tenth of its variance.
  const double scatter = std::sqrt((variance * weight.square()).mean() / how_->estimates());
  for (Index i = 0; i < count; ++i)
    if (weakest(i) * weight(i) > least_contrast * scatter) out.push_back({mean(i) / share(i), variance(i) / share(i)});
  count_ = 0;
}

}  // namespace debulk
