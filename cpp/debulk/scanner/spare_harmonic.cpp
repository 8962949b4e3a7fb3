#include "debulk/scanner/spare_harmonic.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <Eigen/Dense>

#include "debulk/core/simd.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

constexpr int highest = 18;           // multiple of the phase; the harmonics of a gamma of 0.45 are below 0.4 % from here on
constexpr double least_contrast = 5;  // a lit pixel's modulation exceeds this many standard deviations of a grey value
constexpr double pi = 3.14159265358979323846;
constexpr int segment = SpareFit::pixels;

// Begins with the level of each pixel, and with its weight, by the noise of light.
DEBULK_WIDE void begin_fit(const SpareHarmonic& how, const double* values, int count, SpareFit& f) {
  const int images = how.steps * how.periods;
  double *level = f.design.data(), most = 0;
  for (int i = 0; i < segment; ++i) level[i] = 0;
  for (int k = 0; k < images; ++k)
    for (int i = 0; i < segment; ++i) level[i] += values[k * segment + i];
  for (int i = 0; i < segment; ++i) level[i] /= images, most = std::max(most, level[i]);
  for (int i = 0; i < segment; ++i) {
    f.weight[i] = i < count ? 1 / std::sqrt(level[i] + 0.01 * most) : 0;
    f.variance[i] = f.mean[i] = f.share[i] = 0, f.weakest[i] = std::numeric_limits<double>::infinity();
  }
}

// The values' sum with a step's factors each.
DEBULK_INLINE void combine(const double* values, const std::vector<double>& factors, double scale, double* out) {
  const int steps = static_cast<int>(factors.size());
  for (int i = 0; i < segment; ++i) out[i] = 0;
  for (int k = 0; k < steps; ++k) {
    const double factor = factors[static_cast<std::size_t>(k)];
    for (int i = 0; i < segment; ++i) out[i] += factor * values[k * segment + i];
  }
  for (int i = 0; i < segment; ++i) out[i] *= scale;
}

// The modulation times cosine and sine of the multiples of the phase, and the combination that they are fitted to.
DEBULK_WIDE void design_terms(const SpareHarmonic& how, const double* values, int sets, SpareFit& f) {
  double *row = f.design.data() + segment, turn_c[segment], turn_s[segment], power_c[segment], power_s[segment];
  for (int set = 0; set < sets; ++set) {
    double *c = f.c[set], *s = f.s[set], *modulation = f.modulation[set];
    combine(values + set * how.steps * segment, how.cosine, 2.0 / how.steps, c);
    combine(values + set * how.steps * segment, how.sine, -2.0 / how.steps, s);
    for (int i = 0; i < segment; ++i) {
      modulation[i] = std::max(std::sqrt(c[i] * c[i] + s[i] * s[i]), 1e-9);
      f.weakest[i] = std::min(f.weakest[i], modulation[i]);
      turn_c[i] = power_c[i] = c[i] / modulation[i], turn_s[i] = power_s[i] = s[i] / modulation[i];
    }
    int reached = 1;
    for (const int multiple : how.multiples) {
      for (; reached < multiple; ++reached)
        for (int i = 0; i < segment; ++i) {
          const double next = power_c[i] * turn_c[i] - power_s[i] * turn_s[i];
          power_s[i] = power_c[i] * turn_s[i] + power_s[i] * turn_c[i], power_c[i] = next;
        }
      for (int i = 0; i < segment; ++i) row[i] = modulation[i] * power_c[i], row[segment + i] = modulation[i] * power_s[i];
      row += 2 * segment;
    }
  }
  combine(values, how.weights, 1, f.value);
  if (sets == 2) {
    combine(values + how.steps * segment, how.weights, 1, turn_c);
    for (int i = 0; i < segment; ++i) f.value[i] -= turn_c[i];
  }
}

// The sum of a product over all pixels, of which eight are added at a time.
DEBULK_INLINE double dot(const double* a, const double* b) {
  double part[8] = {}, sum = 0;
  for (int i = 0; i < segment; i += 8)
    for (int k = 0; k < 8; ++k) part[k] += a[i + k] * b[i + k];
  for (double one : part) sum += one;
  return sum;
}

DEBULK_WIDE void normal_equations(int terms, SpareFit& f, double* normal, double* right) {
  double* weighted = f.weighted.data();
  for (int j = 0; j < terms; ++j)
    for (int i = 0; i < segment; ++i) weighted[j * segment + i] = f.design[static_cast<std::size_t>(j * segment + i)] * f.weight[i];
  double value[segment];
  for (int i = 0; i < segment; ++i) value[i] = f.value[i] * f.weight[i];
  for (int j = 0; j < terms; ++j) {
    right[j] = dot(weighted + j * segment, value);
    for (int k = 0; k <= j; ++k) normal[j * terms + k] = normal[k * terms + j] = dot(weighted + j * segment, weighted + k * segment);
  }
}

// Adds what the fit leaves of the combination to the variances, and its share of a grey value's to theirs.
DEBULK_WIDE void add_variances(const SpareHarmonic& how, const double* values, int sets, const double* lower, const double* found,
                               SpareFit& f) {
  const int each = 2 * static_cast<int>(how.multiples.size()), terms = 1 + sets * each;
  double leverage[segment] = {}, rest[segment], by_c[segment], by_s[segment];
  const double *design = f.design.data(), *weighted = f.weighted.data();
  double* solved = f.solved.data();
  for (int i = 0; i < segment; ++i) rest[i] = f.value[i];
  for (int j = 0; j < terms; ++j) {  // lower is a matrix in columns
    double* own = solved + j * segment;
    for (int i = 0; i < segment; ++i) own[i] = weighted[j * segment + i], rest[i] -= design[j * segment + i] * found[j];
    for (int k = 0; k < j; ++k) {
      const double factor = lower[k * terms + j];
      for (int i = 0; i < segment; ++i) own[i] -= factor * solved[k * segment + i];
    }
    const double inverse = 1 / lower[j * terms + j];
    for (int i = 0; i < segment; ++i) own[i] *= inverse, leverage[i] += own[i] * own[i];
  }
  for (int i = 0; i < segment; ++i) f.variance[i] += rest[i] * rest[i] / std::max(1 - leverage[i], 0.1);
  for (int set = 0; set < sets; ++set) {
    // A grey value's noise enters the residual by its weight in the combination, and by the fringes to which the
    // fitted value belongs. With gamma, both are alike in size.
    double outward[segment] = {}, across[segment] = {};
    for (int j = 0; j < each; j += 2) {
      const double *own = design + (1 + set * each + j) * segment, *size = found + 1 + set * each + j;
      const int multiple = how.multiples[static_cast<std::size_t>(j / 2)];
      for (int i = 0; i < segment; ++i) {
        outward[i] += own[i] * size[0] + own[segment + i] * size[1];
        across[i] += multiple * (own[i] * size[1] - own[segment + i] * size[0]);
      }
    }
    const double *c = f.c[set], *s = f.s[set];
    for (int i = 0; i < segment; ++i) {
      const double square = f.modulation[set][i] * f.modulation[set][i];
      by_c[i] = (outward[i] * c[i] - across[i] * s[i]) / square, by_s[i] = (outward[i] * s[i] + across[i] * c[i]) / square;
    }
    for (int k = 0; k < how.steps; ++k) {
      const auto at = static_cast<std::size_t>(k);
      const double own_weight = set == 0 ? how.weights[at] : -how.weights[at];
      const double of_c = 2 * how.cosine[at] / how.steps, of_s = 2 * how.sine[at] / how.steps;
      const double* grey = values + (set * how.steps + k) * segment;
      for (int i = 0; i < segment; ++i) {
        const double by_value = own_weight - (of_c * by_c[i] - of_s * by_s[i]);
        f.share[i] += by_value * by_value, f.mean[i] += by_value * by_value * grey[i];
      }
    }
  }
}

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
  for (std::size_t image = 0; image < values_.size(); image += segment)  // whole groups, whose rest has no weight
    std::fill(values_.begin() + static_cast<std::ptrdiff_t>(image) + count_, values_.begin() + static_cast<std::ptrdiff_t>(image) + segment,
              values_[image + static_cast<std::size_t>(count_) - 1]);
  const int sets = how_->steps == 3 ? 2 : 1;  // numbers of periods in one combination
  const int each = 2 * static_cast<int>(how_->multiples.size()), terms = 1 + sets * each;
  const auto room = [&](int rows) { return static_cast<std::size_t>(rows) * segment; };
  fit_.design.resize(room(terms)), fit_.weighted.resize(room(terms)), fit_.solved.resize(room(terms));
  begin_fit(*how_, values_.data(), count_, fit_);
  for (int p = 0; p + sets <= (sets == 2 ? 2 : how_->periods); ++p) {
    const double* values = values_.data() + room(p * how_->steps);
    design_terms(*how_, values, sets, fit_);
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(terms, terms);
    Eigen::VectorXd right(terms);
    normal_equations(terms, fit_, normal.data(), right.data());
    normal.diagonal().array() += 1e-9 * normal.trace();  // fringes along the rows do not tell the terms apart
    const Eigen::LLT<Eigen::MatrixXd> factor(normal);
    const Eigen::VectorXd found = factor.solve(right);
    const Eigen::MatrixXd lower = factor.matrixL();
    add_variances(*how_, values, sets, lower.data(), found.data(), fit_);
  }
  // A pixel that no fringe lights has a phase of noise, which the fitted terms follow: it would show a tenth of its variance.
  double sum = 0;
  for (int i = 0; i < count_; ++i) sum += fit_.variance[i] * fit_.weight[i] * fit_.weight[i];
  const double scatter = std::sqrt(sum / count_ / how_->estimates());
  for (int i = 0; i < count_; ++i)
    if (fit_.weakest[i] * fit_.weight[i] > least_contrast * scatter)
      out.push_back({fit_.mean[i] / fit_.share[i], fit_.variance[i] / fit_.share[i]});
  count_ = 0;
}

}  // namespace debulk
