#include "debulk/scanner/sensor_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int bins = 32;
constexpr long every = 16;  // rows
constexpr double quantisation = 1.0 / 12;
constexpr double pi = 3.14159265358979323846;

struct Bin {
  double count = 0, level = 0, variance = 0;
};
using Bins = std::array<Bin, bins>;

// What the pixel's grey values say of their variance, from combinations that no fringe enters.
class Harmonic {
 public:
  Harmonic(int steps, int periods) : steps_(steps), periods_(periods), weights_(static_cast<std::size_t>(steps)) {
    for (int k = 0; k < steps; ++k) {
      double& w = weights_[static_cast<std::size_t>(k)];
      w = std::cos(2 * pi * (steps / 2) * k / steps);  // alternating for even numbers
      squares_ += w * w;
    }
  }
  double variance(const double* values) const {
    if (steps_ == 3) {  // the means of two numbers of periods agree
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

// variance = read + gain * level through the bins, each weighted by its certainty: count / variance².
SensorNoise line_through(const Bins& all) {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const Bin& bin : all) {
    if (bin.count < 50) continue;
    const double level = bin.level / bin.count, variance = std::max(bin.variance / bin.count, quantisation);
    const double weight = bin.count / (variance * variance);
    w += weight, x += weight * level, y += weight * variance, xx += weight * level * level, xy += weight * level * variance;
  }
  if (w == 0) return {};  // too little was seen: one level
  const double spread = xx - x * x / w;
  double gain = spread > 1e-9 * xx ? (xy - x * y / w) / spread : 0;
  gain = std::max(gain, 0.0);
  double read = (y - gain * x) / w;
  if (read < quantisation) {
    read = quantisation;
    gain = std::max(0.0, (xy - read * x) / xx);
  }
  return {read, gain};
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
  return line_through(all);
}

template SensorNoise estimate_noise(const ImageStack<std::uint8_t>&, int, double, int, int, const Stop&);
template SensorNoise estimate_noise(const ImageStack<std::uint16_t>&, int, double, int, int, const Stop&);

}  // namespace debulk
