#pragma once

#include <array>
#include <cstdint>

#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// A lens mixes the light of neighbouring pixels, and the brighter one's phase counts more: where the brightness changes across
// the fringes, the phase is drawn towards the brighter side, by
//   variance * grad(phase) . grad(ln(modulation))
// for a blur of that variance (px²). That is exact for a Gaussian blur, a linear phase, and a modulation that is exponential or
// a Gaussian highlight as it was measured: the blurred phasor is the integral of the blur times exp((a + i k) x).

// How bright each pixel's fringes are. Maps as `decode` makes them.
struct FringeLight {
  const float* modulation = nullptr;
  const std::uint8_t* exposure = nullptr;
  std::array<float, 256> gain{};  // of each exposure: what makes its grey values those of the first
  int width = 0, height = 0;
};

// The blur's variance (px²) from the images themselves: how far the phase's bends along the rows follow what the texture makes of
// them. The texture two rows above and below stands in for the row's own (an instrumental variable), whose noise would make
// the answer too small. 0 where there is too little texture to say, 1 at most.
double estimate_blur(const float* phase, const FringeLight& light, int threads, const Stop& stop);

// Takes it out of the phases, each direction where the pixels on both sides are of one surface.
void take_out_blur(float* phase, const FringeLight& light, double variance, int threads, const Stop& stop, Isa isa = best_isa());

}  // namespace debulk
