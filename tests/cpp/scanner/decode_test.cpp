#include "debulk/scanner/decode.hpp"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "debulk/core/error.hpp"
#include "scanner/fringes.hpp"

namespace debulk {
namespace {

using test::Fringes;
using test::Maps;
using test::pi;

constexpr long pixels = 5003;  // no multiple of sixteen

double across(long i) {
  return (i + 0.5) / pixels;
}
double grey(long) {
  return 200;
}

TEST(Decode, FindsTheAbsolutePhaseOfEveryPixel) {
  for (const std::vector<int>& periods : {std::vector<int>{50, 51}, {59, 64, 70}, {1, 16}, {16, 1}})
    for (int steps : {3, 4, 6, 7}) {
      const Fringes<std::uint16_t> images(pixels, periods, steps, {20.0}, across, grey, 0, 65535);
      Maps maps(pixels);
      Decoding how = test::decoding(periods, steps);
      how.saturated = 65535;
      const DecodeCounts counts = decode(images.stack, how, maps.view(), Stop());
      EXPECT_EQ(counts.lit, pixels);
      for (long i = 8; i + 8 < pixels; ++i) {  // at the very edge of the field a phase may lie at its other end
        ASSERT_NEAR(maps.phase[i], 2 * pi * periods[0] * across(i), 2e-3) << i << " of " << periods[0] << ", steps " << steps;
        ASSERT_NEAR(maps.modulation[i], 0.45 * 4000, 2);
        ASSERT_NEAR(maps.offset[i], 0.55 * 4000, 2);
        ASSERT_LT(maps.residual[i], 0.05);
      }
    }
}

TEST(Decode, TakesTheBrightestExposureThatNoStepSaturates) {
  const auto bright = [](long i) { return 20.0 * (1 + i % 40); };  // 20 to 800
  const Fringes<std::uint8_t> images(pixels, {50, 51}, 6, {0.1, 0.5, 2.5}, across, bright);
  Maps maps(pixels);
  const DecodeCounts counts = decode(images.stack, test::decoding({50, 51}, 6), maps.view(), Stop());
  long saturated = 0;
  for (long i = 0; i < pixels; ++i) {
    int expected = no_exposure;
    for (int e = 0; e < 3; ++e) {
      int most = 0;
      for (int k = 0; k < 12; ++k)
        most = std::max<int>(most, images.values[static_cast<std::size_t>(12 * e + k)][static_cast<std::size_t>(i)]);
      if (most < 255) expected = e;
    }
    ASSERT_EQ(maps.exposure[i], expected) << i;
    saturated += expected == no_exposure;
    ASSERT_EQ(std::isnan(maps.phase[i]), expected == no_exposure || maps.modulation[i] < 5 * std::sqrt(0.1));
  }
  EXPECT_EQ(counts.saturated, saturated);
  EXPECT_LE(counts.read, 3 * 12 * (pixels + 16));
}

TEST(Decode, ReadsNoExposureThatNoPixelNeeds) {
  const Fringes<std::uint8_t> images(1600, {50, 51}, 6, {0.1, 1.0}, across, grey);
  Maps maps(1600);
  EXPECT_EQ(decode(images.stack, test::decoding({50, 51}, 6), maps.view(), Stop()).read, 12 * 1600);
}

TEST(Decode, NoisePredictsTheErrorsOfThePhase) {
  for (double noise : {1.0, 2.0}) {
    const Fringes<std::uint8_t> images(pixels, {50, 51}, 6, {1.0}, across, grey, noise);
    Maps maps(pixels);
    Decoding how = test::decoding({50, 51}, 6);
    how.noise = {noise * noise + 1.0 / 12, 0};
    decode(images.stack, how, maps.view(), Stop());
    double squares = 0, predicted = 0;
    long count = 0;
    for (long i = 0; i < pixels; ++i) {
      const double error = maps.phase[i] - 2 * pi * 50 * across(i);
      if (!(std::abs(error) < 3)) continue;
      squares += error * error, predicted += maps.noise[i] * maps.noise[i], ++count;
    }
    ASSERT_GT(count, 0.9 * pixels);
    EXPECT_NEAR(std::sqrt(squares / predicted), 1, 0.05);
  }
}

TEST(Decode, DoubtfulOrdersAreMarked) {
  const Fringes<std::uint8_t> images(pixels, {50, 51}, 6, {1.0}, across, [](long) { return 60.0; }, 1.5);
  Maps maps(pixels);
  Decoding how = test::decoding({50, 51}, 6);
  how.noise = {1.5 * 1.5, 0}, how.most_order_noise = 10;
  const DecodeCounts counts = decode(images.stack, how, maps.view(), Stop());
  EXPECT_GT(counts.doubtful, 100);
  for (long i = 0; i < pixels; ++i) ASSERT_EQ(maps.phase[i] < 0, maps.residual[i] > 0.35f);
}

TEST(Decode, OneOrderMoreChangesThePhaseByTheOrderStep) {
  // For 50 and 51 an order of the 51 more is, seen from both, a little less than a period of the 50.
  const double step = order_step(plan_unwrapping({50, 51}));
  EXPECT_NEAR(step, 2 * pi * 50 / 51 * (1 + 50.0 / (50 * 50 + 51 * 51)), 1e-3);
}

TEST(Decode, SameBitsOnAnyInstructionsAndThreadsAndFromImagesThatWereTakenIn) {
  const auto bright = [](long i) { return 40.0 + 37 * (i % 29); };
  const Fringes<std::uint8_t> images(pixels, {50, 51}, 6, {0.1, 0.4, 1.6}, across, bright, 1.0);
  Maps first(pixels);
  Decoding how = test::decoding({50, 51}, 6);
  how.threads = 1, how.isa = Isa::base;
  decode(images.stack, how, first.view(), Stop());
  for (Isa isa : {Isa::base, Isa::v3, Isa::v4})
    for (int threads : {1, 2, 5}) {
      if (isa > best_isa()) continue;
      Maps other(pixels);
      how.threads = threads, how.isa = isa;
      std::vector<std::vector<float>> planes(7, std::vector<float>((pixels + 15) / 16 * 16));
      std::vector<std::uint8_t> exposure(planes[0].size());
      Arrived arrived;
      arrived.best = {{planes[0].data(), planes[1].data()}, planes[2].data(), planes[3].data()};
      arrived.coming = {{planes[4].data()}, planes[5].data(), planes[6].data()}, arrived.exposure = exposure.data();
      for (int e : {0, 1, 2})
        for (int p : {0, 1}) {
          if (e == 2 && p == 1) continue;  // the last ones are decoded when they come
          const auto from = images.stack.images.begin() + 12 * e + 6 * p;
          take_in(std::vector(from, from + 6), pixels, {e, p}, how, arrived, Stop());
        }
      decode(images.stack, how, other.view(), Stop(), threads == 1 ? nullptr : &arrived);
      for (const auto& [a, b] : {std::pair(&first.phase, &other.phase),
                                 {&first.noise, &other.noise},
                                 {&first.modulation, &other.modulation},
                                 {&first.residual, &other.residual}})
        ASSERT_EQ(std::memcmp(a->data(), b->data(), pixels * sizeof(float)), 0);
      ASSERT_EQ(first.exposure, other.exposure);
    }
}

TEST(Decode, EndsWhenItIsStopped) {
  const Fringes<std::uint8_t> images(pixels, {50, 51}, 6, {1.0}, across, grey);
  Maps maps(pixels);
  Stop stop;
  stop.cancel();
  EXPECT_THROW(decode(images.stack, test::decoding({50, 51}, 6), maps.view(), stop), Stopped);
}

TEST(Decode, RefusesAnotherNumberOfImages) {
  Fringes<std::uint8_t> images(pixels, {50, 51}, 6, {1.0}, across, grey);
  images.stack.images.pop_back();
  Maps maps(pixels);
  EXPECT_THROW(decode(images.stack, test::decoding({50, 51}, 6), maps.view(), Stop()), InputError);
}

}  // namespace
}  // namespace debulk
