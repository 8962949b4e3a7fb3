#include "debulk/scanner/sensor_noise.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace debulk {
namespace {

// Fringes over pixels of many brightnesses, whose noise follows read + gain * level; a third harmonic of the projector.
// The lowest rows lie in shadow, and their share of the image is given.
double relative_error(double read, double gain, double harmonic, int steps, SensorNoise& found, double gamma = 1, double shadow = 0) {
  constexpr int width = 384, height = 192;
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  std::vector<std::vector<std::uint8_t>> values;
  for (int n : {50, 51})
    for (int k = 0; k < steps; ++k) {
      std::vector<std::uint8_t> image;
      for (int i = 0; i < width * height; ++i) {
        const double phase = 2 * 3.14159265358979 * (n * (i % width + 0.5) / width + static_cast<double>(k) / steps);
        const double bright = 20 + 210.0 * (i / width) / height;
        const double fringe = 0.84 * std::pow(0.5 + 0.5 * std::cos(phase), gamma) + 0.42 * harmonic * std::cos(3 * phase);
        const double light = bright * (0.08 + (i < (1 - shadow) * width * height ? fringe : 0));
        image.push_back(
            static_cast<std::uint8_t>(std::clamp(std::round(light + std::sqrt(read + gain * light) * normal(random)), 0.0, 255.0)));
      }
      values.push_back(std::move(image));
    }
  ImageStack<std::uint8_t> stack;
  for (const auto& image : values) stack.images.push_back(image.data());
  stack.pixels = width * height;
  found = estimate_noise(stack, steps, 255.0, width, 2, Stop());
  const double expected = read + 1.0 / 12 + gain * 60;
  return (found.read + found.gain * 60) / expected - 1;
}

TEST(SensorNoise, IsFoundInTheImages) {
  SensorNoise found;
  for (int steps : {6, 8, 7})
    for (const auto& [read, gain] : {std::pair(0.3, 0.02), {2.0, 0.0}, {0.0, 0.06}}) {
      EXPECT_NEAR(relative_error(read, gain, 0, steps, found), 0, 0.1) << steps << ", " << read << ", " << gain;
    }
}

TEST(SensorNoise, AHarmonicOfTheProjectorIsNoNoise) {
  SensorNoise found;
  EXPECT_NEAR(relative_error(0.3, 0.02, 0.02, 6, found), 0, 0.2);
}

TEST(SensorNoise, GammaIsNoNoise) {
  SensorNoise found;
  for (int steps : {3, 4, 5, 6, 8, 12})
    for (double gamma : {0.45, 1.0, 2.2}) EXPECT_NEAR(relative_error(0.3, 0.02, 0, steps, found, gamma), 0, 0.2) << steps << ", " << gamma;
}

TEST(SensorNoise, PixelsInShadowDoNotLowerIt) {
  SensorNoise found;
  for (int steps : {3, 4, 6, 8})
    for (double gain : {0.006, 0.02, 0.05})
      for (double gamma : {1.0, 1.5})
        EXPECT_NEAR(relative_error(0.2, gain, 0, steps, found, gamma, 0.3), 0, 0.1) << steps << ", " << gain << ", " << gamma;
}

TEST(SensorNoise, TheSameOnAnyNumberOfThreadsAndAlone) {
  SensorNoise one, two;
  relative_error(0.3, 0.02, 0, 6, one), relative_error(0.3, 0.02, 0, 6, two);
  EXPECT_EQ(one.read, two.read);
  EXPECT_EQ(one.gain, two.gain);
}

}  // namespace
}  // namespace debulk
