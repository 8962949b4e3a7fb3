#include "debulk/scanner/sensor_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/Dense>

#include "debulk/core/median.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/scanner/spare_harmonic.hpp"

namespace debulk {
namespace {

constexpr int bins = 32;
constexpr long most_sampled = 100'000;  // pixels
constexpr double quantisation = 1.0 / 12;

struct Bin {
  double count = 0, level = 0, variance = 0;
};

// Averages the variances at each level, without pixels at edges, where two surfaces mix and the fit does not hold.
std::array<Bin, bins> averaged(const std::vector<std::vector<LevelVariance>>& parts, double saturated, int estimates) {
  std::array<std::vector<LevelVariance>, bins> by_level;
  for (const std::vector<LevelVariance>& part : parts)
    for (const LevelVariance& one : part)
      by_level[static_cast<std::size_t>(std::clamp(bins * one.level / saturated, 0.0, bins - 1.0))].push_back(one);
  // The median of the mean of so many squared normal deviates (Wilson and Hilferty), and twelve times their variance.
  const double median = std::pow(1 - 2.0 / (9 * estimates), 3), cut = 12;
  std::array<Bin, bins> out{};
  std::vector<double> sorted;
  for (std::size_t k = 0; k < bins; ++k) {
    if (by_level[k].empty()) continue;
    sorted.clear();
    for (const LevelVariance& one : by_level[k]) sorted.push_back(one.variance);
    const double most = cut * std::max(upper_median(sorted) / median, quantisation);
    Bin& bin = out[k];
    for (const LevelVariance& one : by_level[k])
      if (one.variance <= most) bin.count += 1, bin.level += one.level, bin.variance += one.variance;
  }
  return out;
}

// Fits variance = read + gain * level to the bins, each weighted by its certainty, count / variance². Neither
// coefficient may be below its least value. All ways to hold one of them there are tried, and the feasible one that
// fits best is taken.
SensorNoise fit(const std::array<Bin, bins>& all) {
  const Eigen::Vector2d least(quantisation, 0);
  Eigen::Matrix2d a = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (const Bin& bin : all) {
    if (bin.count < 50) continue;
    const double level = bin.level / bin.count, variance = std::max(bin.variance / bin.count, quantisation);
    const Eigen::Vector2d row(1, level);
    const double weight = bin.count / (variance * variance);
    a += weight * row * row.transpose(), b += weight * variance * row;
  }
  if (a(0, 0) == 0) return {};  // too little was seen: assume a noise of one level
  Eigen::Vector2d best = least;
  double lowest = std::numeric_limits<double>::infinity();
  for (int held = 0; held < 4; ++held) {
    Eigen::Matrix2d m = a;
    Eigen::Vector2d right = b;
    for (int i = 0; i < 2; ++i)
      if (held >> i & 1) m.row(i).setZero(), m(i, i) = 1, right(i) = least(i);
    const Eigen::Vector2d x = m.fullPivLu().solve(right);
    const double cost = x.dot(a * x) - 2 * x.dot(b);
    if ((x - least).minCoeff() >= -1e-12 && cost < lowest) lowest = cost, best = x;
  }
  return {best(0), best(1)};
}

}  // namespace

template <class T>
SensorNoise estimate_noise(const ImageStack<T>& stack, int steps, double saturated, int width, int threads, const Stop& stop) {
  const int n = stack.images_each();
  const SpareHarmonic spare(steps, n / steps);
  const long rows = stack.pixels / width, every = std::max(1L, stack.pixels / most_sampled), sampled = (rows + every - 1) / every;
  constexpr long chunk = 8;
  std::vector<std::vector<LevelVariance>> parts(static_cast<std::size_t>((sampled + chunk - 1) / chunk));
  parallel_for(sampled, chunk, threads, stop, [&](long begin, long end) {
    std::vector<LevelVariance>& part = parts[static_cast<std::size_t>(begin / chunk)];
    std::vector<double> values(static_cast<std::size_t>(n));
    const auto each = static_cast<std::size_t>(width);
    std::vector<T> tops(each * static_cast<std::size_t>(stack.exposures));  // the greatest grey value of each pixel and exposure
    // Exposures are fitted apart, because a lamp flickers differently in each.
    std::vector<SpareSegment> segments(static_cast<std::size_t>(stack.exposures), SpareSegment(spare));
    for (long s = begin; s < end; ++s) {
      const long row = std::min(s * every + every / 2, rows - 1) * width;
      std::fill(tops.begin(), tops.end(), T{});
      for (int e = 0; e < stack.exposures; ++e)
        for (int k = 0; k < n; ++k) {
          const T* grey = stack.exposure(e)[k] + row;
          T* top = tops.data() + static_cast<std::size_t>(e) * each;
          for (std::size_t i = 0; i < each; ++i) top[i] = std::max(top[i], grey[i]);
        }
      for (std::size_t i = 0; i < each; ++i)
        for (int e = stack.exposures - 1; e >= 0; --e) {
          if (tops[static_cast<std::size_t>(e) * each + i] >= saturated) continue;
          const T* const* from = stack.exposure(e);
          for (int k = 0; k < n; ++k) values[static_cast<std::size_t>(k)] = from[k][row + static_cast<long>(i)];
          segments[static_cast<std::size_t>(e)].add(values.data(), part);
          break;
        }
    }
    for (SpareSegment& segment : segments) segment.finish(part);
  });
  return fit(averaged(parts, saturated, spare.estimates()));
}

template SensorNoise estimate_noise(const ImageStack<std::uint8_t>&, int, double, int, int, const Stop&);
template SensorNoise estimate_noise(const ImageStack<std::uint16_t>&, int, double, int, int, const Stop&);

}  // namespace debulk
