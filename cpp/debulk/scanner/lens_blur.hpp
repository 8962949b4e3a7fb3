#pragma once

#include <array>
#include <cstdint>

#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// A lens mixes the light of neighbouring pixels, and the phase of the brighter pixel counts more. Where the brightness
// changes across the fringes, the phase is therefore drawn towards the brighter side, by
//   variance * grad(phase) . grad(ln(modulation))
// for a blur of that variance (px²). This is exact for a Gaussian blur of a linear phase if the modulation is
// exponential, or if the modulation as measured is a Gaussian highlight: the blurred phasor is the integral of the
// blur times exp((a + i k) x).

// How bright each pixel's fringes are, in maps as `decode` makes them.
struct FringeLight {
  const float* modulation = nullptr;
  const std::uint8_t* exposure = nullptr;
  std::array<float, 256> gain{};  // per exposure, the factor that converts its grey values to those of the first
  int width = 0, height = 0;
};

// Estimates the blur's variance (px²) from the images themselves, as the ratio of the bends of the phase along the
// rows to the bends that the texture predicts for a variance of 1. The texture two rows above and below stands in for
// the row's own (an instrumental variable), because noise in the row's own texture would make the estimate too small.
// The result is 0 if there is too little texture to say, and 1 at most.
double estimate_blur(const float* phase, const FringeLight& light, int threads, const Stop& stop);

// Removes the effect of a blur of this variance from the phases. In each direction (along rows and along columns) a
// phase is corrected only where the pixels on both sides belong to the same surface.
void take_out_blur(float* phase, const FringeLight& light, double variance, int threads, const Stop& stop, Isa isa = best_isa());

}  // namespace debulk
