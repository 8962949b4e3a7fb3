#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "debulk/scanner/decode.hpp"

namespace debulk::test {

constexpr double pi = 3.14159265358979323846;

// Images of pixels that lie at u(pixel) of the field, with an offset and a modulation, for several exposures; written from the
// formula of the patterns alone.
template <class T>
struct Fringes {
  std::vector<std::vector<T>> values;
  ImageStack<T> stack;

  Fringes(long pixels, const std::vector<int>& periods, int steps, const std::vector<double>& exposures,
          const std::function<double(long)>& u, const std::function<double(long)>& bright, double noise = 0, double white = 255) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal(0, 1);
    for (double exposure : exposures)
      for (int n : periods)
        for (int k = 0; k < steps; ++k) {
          std::vector<T> image;
          for (long i = 0; i < pixels; ++i) {
            const double light = exposure * bright(i) * (0.55 + 0.45 * std::cos(2 * pi * (n * u(i) + static_cast<double>(k) / steps)));
            image.push_back(static_cast<T>(std::clamp(std::round(light + noise * normal(random)), 0.0, white)));
          }
          values.push_back(std::move(image));
        }
    for (const std::vector<T>& image : values) stack.images.push_back(image.data());
    stack.exposures = static_cast<int>(exposures.size()), stack.pixels = pixels;
  }
};

// Maps of a number of pixels.
struct Maps {
  std::vector<float> phase, noise, modulation, offset, residual;
  std::vector<std::uint8_t> exposure;
  explicit Maps(long pixels) : phase(pixels), noise(pixels), modulation(pixels), offset(pixels), residual(pixels), exposure(pixels) {}
  PhaseMaps view() { return {phase.data(), noise.data(), modulation.data(), offset.data(), residual.data(), exposure.data()}; }
};

inline Decoding decoding(const std::vector<int>& periods, int steps) {
  Decoding how;
  how.steps = steps, how.plan = plan_unwrapping(periods), how.noise = {0.1, 0};
  return how;
}

}  // namespace debulk::test
