#include "debulk/scanner/sensor_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/Dense>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int bins = 32;
constexpr long every = 16;  // one row of so many is used
constexpr double quantisation = 1.0 / 12;
constexpr double pi = 3.14159265358979323846;

struct Bin {
  double count = 0, level = 0, variance = 0;
};
using Bins = std::array<Bin, bins>;

// Estimates the variance of a pixel's grey values from combinations of them in which the fringes cancel.
class Harmonic {
 public:
  Harmonic(int steps, int periods) : steps_(steps), periods_(periods), weights_(static_cast<std::size_t>(steps)) {
    for (int k = 0; k < steps; ++k) {
      double& w = weights_[static_cast<std::size_t>(k)];
      w = std::cos(2 * pi * (steps / 2) * k / steps);  // alternating for even numbers of steps
      squares_ += w * w;
    }
  }
  double variance(const double* values) const {
    if (steps_ == 3) {  // the means at two numbers of periods should agree
      const double one = values[0] + values[1] + values[2], other = values[3] + values[4] + values[5];
      return (one - other) * (one - other) / 6;
    }
    double sum = 0;
    for (int p = 0; p < periods_; ++p) {
      double h = 0;
      for (int k = 0; k < steps_; ++k) h += weights_[static_cast<std::size_t>(k)] * values[p * steps_ + k];
      sum += h * h / squares_;
    }
    return sum / periods_;
  }

 private:
  int steps_, periods_;
  std::vector<double> weights_;
  double squares_ = 0;
};

// Fits variance = read + gain * level + harmonic * level² to the bins, each weighted by its certainty,
// count / variance². The part that grows with the square of the level is not noise: it is a higher harmonic of the
// projector, which the phase does not see, or a flicker. None of the three coefficients may be below its least value.
// All ways to hold some of them at that value are tried, and the feasible one that fits best is taken.
SensorNoise fit(const Bins& all) {
  const Eigen::Vector3d least(quantisation, 0, 0);
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Bin& bin : all) {
    if (bin.count < 50) continue;
    const double level = bin.level / bin.count, variance = std::max(bin.variance / bin.count, quantisation);
    const Eigen::Vector3d row(1, level, level * level);
    const double weight = bin.count / (variance * variance);
    a += weight * row * row.transpose(), b += weight * variance * row;
  }
  if (a(0, 0) == 0) return {};  // too little was seen: assume a noise of one level
  Eigen::Vector3d best = least;
  double lowest = std::numeric_limits<double>::infinity();
  for (int held = 0; held < 8; ++held) {
    Eigen::Matrix3d m = a;
    Eigen::Vector3d right = b;
    for (int i = 0; i < 3; ++i)
      if (held >> i & 1) m.row(i).setZero(), m(i, i) = 1, right(i) = least(i);
    const Eigen::Vector3d x = m.fullPivLu().solve(right);
    const double cost = x.dot(a * x) - 2 * x.dot(b);
    if ((x - least).minCoeff() >= -1e-12 && cost < lowest) lowest = cost, best = x;
  }
  return {best(0), best(1)};
}

}  // namespace

template <class T>
SensorNoise estimate_noise(const ImageStack<T>& stack, int steps, double saturated, int width, int threads, const Stop& stop) {
  const int n = stack.images_each();
  const Harmonic harmonic(steps, n / steps);
  const long rows = stack.pixels / width, sampled = (rows + every - 1) / every;
  std::vector<Bins> parts(static_cast<std::size_t>(sampled));
  parallel_for(sampled, 4, threads, stop, [&](long begin, long end) {
    std::vector<double> values(static_cast<std::size_t>(n));
    for (long s = begin; s < end; ++s) {
      Bins& part = parts[static_cast<std::size_t>(s)];
      const long row = std::min(s * every + every / 2, rows - 1) * width;
      for (long i = row; i < row + width; ++i)
        for (int e = stack.exposures - 1; e >= 0; --e) {
          double top = 0, sum = 0;
          for (int k = 0; k < n; ++k) {
            const double v = values[static_cast<std::size_t>(k)] = stack.exposure(e)[k][i];
            top = std::max(top, v), sum += v;
          }
          if (top >= saturated) continue;
          const double level = sum / n;
          Bin& bin = part[static_cast<std::size_t>(std::min(bins - 1.0, bins * level / saturated))];
          bin.count += 1, bin.level += level, bin.variance += harmonic.variance(values.data());
          break;
        }
    }
  });
  Bins all{};
  for (const Bins& part : parts)
    for (std::size_t b = 0; b < bins; ++b)
      all[b].count += part[b].count, all[b].level += part[b].level, all[b].variance += part[b].variance;
  return fit(all);
}

template SensorNoise estimate_noise(const ImageStack<std::uint8_t>&, int, double, int, int, const Stop&);
template SensorNoise estimate_noise(const ImageStack<std::uint16_t>&, int, double, int, int, const Stop&);

}  // namespace debulk
