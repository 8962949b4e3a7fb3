#include "debulk/scanner/decode.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr double pi = 3.14159265358979323846;
constexpr int most_images = 64;  // per exposure
constexpr long chunk = 1 << 11;  // groups of sixteen pixels that a thread takes at once

// The constants that the loop needs, in single precision.
struct Tables {
  int steps, periods, stages, top;
  float cosine[most_images], sine[most_images];  // of the steps
  float per_step;                                // 2 / steps
  float period_count[most_periods];              // each number of periods divided by the greatest
  float share[most_periods];                     // weight of each phase in the combined phase, over its period_count
  float weight[8][most_periods];                 // weights of the wrapped phases in the combination of each stage
  float stage_periods[8], stage_ratio[8];        // periods of each stage; the same over those of the stage before
  float saturated, read, gain, contrast, most_residual, most_order_noise;
  float order_noise;  // standard deviation of the least certain order if a wrapped phase's is one turn
  float to_rad;       // converts turns at the greatest number of periods to radians at the first
  float start, back;  // the start phase, turns; what it adds to the phase, rad
  float phase_noise;  // rad of the combined phase, for a grey value's noise divided by the modulation
  float turn_noise;   // the same in turns of one wrapped phase
};

// The usual pattern, for which the compiler unrolls the loops over its steps and numbers of periods.
struct UsualTables : Tables {
  static constexpr int steps = 6, periods = 2;
};

// Calls the function with the tables, of a type of their own if the pattern is the usual one.
template <class Function>
void with_pattern(const Tables& t, const Function& function) {
  if (t.steps == UsualTables::steps && t.periods == UsualTables::periods)
    function(UsualTables{t});
  else
    function(t);
}

#define DEBULK_KERNEL "debulk/scanner/decode_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

Tables tables_of(const Decoding& how) {
  Tables t{};
  const UnwrapPlan& plan = how.plan;
  t.steps = how.steps, t.periods = static_cast<int>(plan.periods.size()), t.stages = static_cast<int>(plan.stages.size()), t.top = plan.top;
  for (int k = 0; k < how.steps; ++k)
    t.cosine[k] = static_cast<float>(std::cos(2 * pi * k / how.steps)), t.sine[k] = static_cast<float>(std::sin(2 * pi * k / how.steps));
  t.per_step = 2.0f / static_cast<float>(how.steps);
  double squares = 0;
  const double greatest = plan.periods[static_cast<std::size_t>(plan.top)], first = plan.periods[0];
  for (int n : plan.periods) squares += static_cast<double>(n) * n;
  for (std::size_t i = 0; i < plan.periods.size(); ++i) {
    const double n = plan.periods[i];
    t.period_count[i] = static_cast<float>(n / greatest);
    t.share[i] = static_cast<float>(n * n / squares * greatest / n);
  }
  for (std::size_t s = 0; s < plan.stages.size(); ++s) {
    for (std::size_t i = 0; i < most_periods; ++i) t.weight[s][i] = static_cast<float>(plan.stages[s].weights[i]);
    t.stage_periods[s] = static_cast<float>(plan.stages[s].periods);
    t.stage_ratio[s] = s == 0 ? 1.0f : static_cast<float>(static_cast<double>(plan.stages[s].periods) / plan.stages[s - 1].periods);
  }
  t.saturated = static_cast<float>(how.saturated), t.contrast = static_cast<float>(how.least_contrast);
  t.read = static_cast<float>(how.noise.read), t.gain = static_cast<float>(how.noise.gain);
  t.most_residual = static_cast<float>(how.most_residual), t.most_order_noise = static_cast<float>(how.most_order_noise);
  t.order_noise = static_cast<float>(plan.order_noise);
  double mean = 0;  // of the phases at the first number of periods, if that of each number of periods is 1
  for (int n : plan.periods) mean += n * first / squares;
  t.start = static_cast<float>(how.start), t.back = static_cast<float>(2 * pi * mean * how.start);
  t.to_rad = static_cast<float>(2 * pi * first / greatest);
  const double wrapped = std::sqrt(2.0 / how.steps);  // rad, if noise divided by modulation is 1
  t.turn_noise = static_cast<float>(wrapped / (2 * pi));
  t.phase_noise = static_cast<float>(wrapped * first / std::sqrt(squares));
  return t;
}

void check(const Decoding& how, long pixels) {
  require(how.steps >= 3 && how.steps * how.plan.periods.size() <= most_images, "steps", "3 or more, and at most 64 images", how.steps);
  require(pixels >= 16, "images", "at least 16 pixels", pixels);
  require(how.plan.stages.size() <= 8, "periods", "numbers that unwrap in eight stages", how.plan.stages.size());
}

}  // namespace

DecodeCounts& DecodeCounts::operator+=(const DecodeCounts& other) {
  lit += other.lit, saturated += other.saturated, doubtful += other.doubtful, read += other.read;
  return *this;
}

double order_step(const UnwrapPlan& plan) {
  double squares = 0, change = 1;
  const double greatest = plan.periods[static_cast<std::size_t>(plan.top)];
  for (int n : plan.periods) squares += static_cast<double>(n) * n;
  for (int n : plan.periods) {
    const double expected = n / greatest;  // turns of this phase for one order more; its whole part has no effect
    change -= n * n / squares * greatest / n * (expected - std::round(expected));
  }
  return 2 * pi * plan.periods[0] / greatest * change;
}

template <class T>
void take_in(const std::vector<const T*>& images, long pixels, const Place& place, const Decoding& how, const Arrived& kept,
             const Stop& stop) {
  check(how, pixels);
  require(static_cast<int>(images.size()) == how.steps, "images", "as many as steps", images.size());
  require(place.period >= 0 && static_cast<std::size_t>(place.period) < how.plan.periods.size(), "period",
          "the place of a number of periods", place.period);
  require(place.exposure >= 0 && place.exposure < no_exposure, "exposure", "0 to 254", place.exposure);
  require(place.exposure == 0 || kept.coming.offset, "exposure", "planes for the exposure that is coming", place.exposure);
  const Tables tables = tables_of(how);
  with_pattern(tables, [&](const auto& pattern) {
    parallel_for(pixels / 16, chunk, how.threads, stop,
                 [&](long begin, long end) { DEBULK_ON(how.isa, take_groups(images.data(), pixels, pattern, place, kept, begin, end)); });
  });
}

template <class T>
DecodeCounts decode(const ImageStack<T>& stack, const Decoding& how, const PhaseMaps& maps, const Stop& stop, const Arrived* arrived) {
  check(how, stack.pixels);
  require(static_cast<std::size_t>(stack.images_each()) == how.steps * how.plan.periods.size(), "images", "steps times periods",
          stack.images_each());
  require(stack.exposures >= 1 && stack.exposures < no_exposure, "images", "1 to 254 exposures", stack.exposures);
  require(!arrived || stack.exposures == 1 || arrived->coming.offset, "planes", "planes for the last exposure", "None");

  const Tables tables = tables_of(how);
  const long groups = stack.pixels / 16;
  std::vector<DecodeCounts> parts(static_cast<std::size_t>((groups + chunk - 1) / chunk));
  with_pattern(tables, [&](const auto& pattern) {
    parallel_for(groups, chunk, how.threads, stop, [&](long begin, long end) {
      DecodeCounts& part = parts[static_cast<std::size_t>(begin / chunk)];
      DEBULK_ON(how.isa, run(stack, pattern, maps, arrived, begin, end, part));
    });
  });
  DecodeCounts all;
  for (const DecodeCounts& part : parts) all += part;
  return all;
}

template void take_in(const std::vector<const std::uint8_t*>&, long, const Place&, const Decoding&, const Arrived&, const Stop&);
template void take_in(const std::vector<const std::uint16_t*>&, long, const Place&, const Decoding&, const Arrived&, const Stop&);
template DecodeCounts decode(const ImageStack<std::uint8_t>&, const Decoding&, const PhaseMaps&, const Stop&, const Arrived*);
template DecodeCounts decode(const ImageStack<std::uint16_t>&, const Decoding&, const PhaseMaps&, const Stop&, const Arrived*);

}  // namespace debulk
