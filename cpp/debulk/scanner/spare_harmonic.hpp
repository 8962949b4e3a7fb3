#pragma once

#include <cstddef>
#include <vector>

namespace debulk {

// The variance of a grey value of this level, estimated from one pixel.
struct LevelVariance {
  double level = 0, variance = 0;
};

// Combinations of the steps in which the fringes cancel: the highest harmonic at each number of periods, or, with three
// steps, the difference of the means at the first two numbers of periods.
struct SpareHarmonic {
  int steps, periods;
  std::vector<double> cosine, sine, weights;  // of the steps; the weights' squares add up to 1
  std::vector<int> multiples;                 // multiples of the phase that the steps cannot tell from the combination, and 1

  SpareHarmonic(int step_count, int period_count);
  int estimates() const { return steps == 3 ? 1 : periods; }  // combinations per pixel
};

// What is kept of the pixels that are fitted together: each array has a value per pixel; c and s: modulation times cosine and
// sine of the phase, of each number of periods in the combination.
struct SpareFit {
  static constexpr int pixels = 256;
  double weight[pixels], variance[pixels], mean[pixels], value[pixels];
  double share[pixels];    // of the variance of a grey value that the residuals have
  double weakest[pixels];  // the least modulation
  double c[2][pixels], s[2][pixels], modulation[2][pixels];
  std::vector<double> design, weighted, solved;  // the terms of the fit, one after the other; the first is the level
};

// Neighbouring pixels of one exposure. Whenever there are enough of them, what is no noise in their combinations is
// fitted: the mean level times a constant (a lamp that flickers), and the modulation times cosine and sine of the
// multiples of the phase (flicker and gamma).
class SpareSegment {
 public:
  explicit SpareSegment(const SpareHarmonic& how);
  void add(const double* values, std::vector<LevelVariance>& out);
  void finish(std::vector<LevelVariance>& out);  // fits the pixels that are left

 private:
  void fit(std::vector<LevelVariance>& out);

  const SpareHarmonic* how_;
  std::vector<double> values_;  // of each image, one after the other, the grey values of all pixels
  int count_ = 0;               // pixels
  SpareFit fit_{};
};

}  // namespace debulk
