#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"

// Clouds for the tests of this room: made by formulas, or by a generator with the same bits on every platform.
namespace debulk::testing {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

struct Cloud {
  int width = 0, height = 1;
  std::vector<float> xyz;

  CloudView view() const { return {xyz.data(), width, height}; }
  // The same points as an unorganised cloud.
  CloudView flat() const { return {xyz.data(), width * height, 1}; }
  float* point(int column, int row) { return &xyz[3 * (static_cast<std::size_t>(row) * width + column)]; }
};

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15u + 1) {}
  double uniform() {  // splitmix64
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  double normal() {  // Box and Muller
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * M_PI * uniform());
  }
  int below(int n) { return static_cast<int>(uniform() * n); }

 private:
  std::uint64_t state_;
};

inline Cloud make(int width, int height, const std::function<void(int, int, float*)>& fill) {
  Cloud cloud{width, height, std::vector<float>(3 * static_cast<std::size_t>(width) * height)};
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) fill(column, row, cloud.point(column, row));
  return cloud;
}

// A wavy sheet with a bell, noise, 2 % missing pixels and 0.5 % flying ones, some of them in runs.
inline Cloud sheet(int width, int height, std::uint64_t seed) {
  Random random(seed);
  int run = 0;
  float lift = 0;
  return make(width, height, [&](int i, int j, float* p) {
    const double x = 0.55 * i + 0.02 * random.normal(), y = 0.55 * j + 0.02 * random.normal();
    p[0] = static_cast<float>(x);
    p[1] = static_cast<float>(y);
    p[2] = static_cast<float>(0.002 * (x - 30) * (x - 30) * std::exp(-x / 100) +
                              3 * std::exp(-((x - 20) * (x - 20) + (y - 15) * (y - 15)) / 60) + 0.05 * random.normal());
    if (run == 0 && random.uniform() < 0.003) run = 1 + random.below(3), lift = static_cast<float>(40 * random.uniform() - 20);
    if (run > 0) --run, p[2] += lift;
    if (random.uniform() < 0.02) p[random.below(3)] = nan;
  });
}

}  // namespace debulk::testing
