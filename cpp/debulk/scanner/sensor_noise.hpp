#pragma once

#include <cstdint>

#include "debulk/core/stop.hpp"
#include "debulk/scanner/image_stack.hpp"

namespace debulk {

// Variance of a grey value in the photon-transfer model: read + gain * value, in squared grey levels.
struct SensorNoise {
  double read = 1;
  double gain = 0;
};

// Estimates the noise from the images themselves. With six steps or more, the highest harmonic of the steps contains
// no fringe, only noise. With four or five, the effect of a projector's gamma is taken for noise too; with three, the
// means of the first two numbers of periods are compared. Every sixteenth row is used, each of its pixels at the
// brightest exposure that is not saturated.
template <class T>
SensorNoise estimate_noise(const ImageStack<T>& stack, int steps, double saturated, int width, int threads, const Stop& stop);

}  // namespace debulk
