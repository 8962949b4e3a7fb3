#include "debulk/scanner/lens_blur.hpp"

#include <cmath>
#include <complex>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace debulk {
namespace {

constexpr int width = 203, height = 150;  // more than two strips

struct Picture {
  std::vector<float> phase, modulation, sharp;
  std::vector<std::uint8_t> exposure;
  FringeLight light() const {
    FringeLight l;
    l.modulation = modulation.data(), l.exposure = exposure.data(), l.width = width, l.height = height;
    l.gain[0] = 1, l.gain[1] = 0.25f;
    return l;
  }
};

// What a lens of this blur (px) makes of fringes on a surface of this brightness: phasors are added up, pixel by pixel.
Picture blurred(double blur, double noise_rad, const std::function<double(double, double)>& brightness) {
  const auto phase = [](double x, double y) { return 20 + 0.25 * x + 0.02 * y; };
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, 1);
  Picture out;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      std::complex<double> sum;
      double weights = 0;
      for (double v = -4; v <= 4; v += 0.5)
        for (double u = -4; u <= 4; u += 0.5) {
          const double weight = blur > 0 ? std::exp(-0.5 * (u * u + v * v) / (blur * blur)) : u == 0 && v == 0;
          sum += weight * brightness(x + u, y + v) * std::polar(1.0, phase(x + u, y + v) - phase(x, y));
          weights += weight;
        }
      sum /= weights;
      sum += noise_rad * std::abs(sum) * std::complex<double>(normal(random), normal(random));
      out.sharp.push_back(static_cast<float>(phase(x, y)));
      out.phase.push_back(static_cast<float>(phase(x, y) + std::arg(sum)));
      out.exposure.push_back(x / 20 % 2 == 0 ? 0 : 1);
      out.modulation.push_back(static_cast<float>(std::abs(sum) * (x / 20 % 2 == 0 ? 1 : 4)));
    }
  return out;
}

double texture(double x, double y) {
  return 50 * std::exp(0.5 * std::sin(x / 1.9 + y / 5) + 0.4 * std::sin(y / 1.7 - x / 3.1));
}

double rms_off(const std::vector<float>& phase, const Picture& picture) {
  double squares = 0;
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x) {
      const std::size_t at = static_cast<std::size_t>(y * width + x);
      squares += std::pow(phase[at] - picture.sharp[at], 2);
    }
  return std::sqrt(squares / ((width - 2) * (height - 2)));
}

TEST(LensBlur, TheTexturesPartOfThePhaseGoes) {
  Picture picture = blurred(0.6, 0, texture);
  const double before = rms_off(picture.phase, picture);
  take_out_blur(picture.phase.data(), picture.light(), 0.36, 2, Stop());
  EXPECT_GT(before, 0.01);
  EXPECT_LT(rms_off(picture.phase, picture), 0.15 * before);
}

TEST(LensBlur, ItIsFoundInNoise) {
  const Picture picture = blurred(0.6, 0.01, texture);
  EXPECT_NEAR(estimate_blur(picture.phase.data(), picture.light(), 2, Stop()), 0.36, 0.04);
}

TEST(LensBlur, NoneIsFoundWhereThereIsNoneOrNoTexture) {
  const Picture sharp = blurred(0, 0.01, texture), plain = blurred(0.6, 0.01, [](double, double) { return 80; });
  EXPECT_LT(estimate_blur(sharp.phase.data(), sharp.light(), 2, Stop()), 0.02);
  EXPECT_EQ(estimate_blur(plain.phase.data(), plain.light(), 2, Stop()), 0);
}

TEST(LensBlur, EdgesAndGapsStayAsTheyAre) {
  Picture picture = blurred(0.6, 0, texture);
  for (int y = 0; y < height; ++y)
    for (int x = 100; x < width; ++x) picture.phase[static_cast<std::size_t>(y * width + x)] += 6;
  picture.phase[static_cast<std::size_t>(50 * width + 30)] = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> before = picture.phase;
  take_out_blur(picture.phase.data(), picture.light(), 0.36, 1, Stop());
  EXPECT_TRUE(std::isnan(picture.phase[static_cast<std::size_t>(50 * width + 30)]));
  for (int y = 1; y + 1 < height; ++y)
    for (int x : {98, 99, 100, 101}) {  // at the edge only the rows beside count, in which the phase hardly changes
      const std::size_t at = static_cast<std::size_t>(y * width + x);
      EXPECT_NEAR(picture.phase[at], before[at], x == 98 || x == 101 ? 0.1 : 0.003);
    }
}

TEST(LensBlur, SameBitsOnAnyInstructionsAndThreads) {
  const Picture picture = blurred(0.6, 0.01, texture);
  std::vector<float> first = picture.phase;
  take_out_blur(first.data(), picture.light(), 0.36, 1, Stop(), Isa::base);
  const double estimate = estimate_blur(picture.phase.data(), picture.light(), 1, Stop());
  for (int threads : {1, 2, 5}) {
    EXPECT_EQ(estimate_blur(picture.phase.data(), picture.light(), threads, Stop()), estimate);
    for (Isa isa : {Isa::base, Isa::v3, Isa::v4}) {
      if (isa > best_isa()) continue;
      std::vector<float> other = picture.phase;
      take_out_blur(other.data(), picture.light(), 0.36, threads, Stop(), isa);
      ASSERT_EQ(std::memcmp(first.data(), other.data(), first.size() * sizeof(float)), 0);
    }
  }
}

}  // namespace
}  // namespace debulk
