#pragma once

#include <cstdint>

#include "debulk/core/stop.hpp"
#include "debulk/scanner/image_stack.hpp"

namespace debulk {

// Variance of a grey value by the photon transfer: read + gain * value, in squared levels.
struct SensorNoise {
  double read = 1;
  double gain = 0;
};

// From the images themselves: the highest harmonic of the steps holds no fringe, only noise (with six steps or more; with
// four or five, a projector's gamma is taken for noise too, and with three the first two numbers of periods are held against
// each other). Every sixteenth row of pixels of the brightest exposure that is not saturated is looked at.
template <class T>
SensorNoise estimate_noise(const ImageStack<T>& stack, int steps, double saturated, int width, int threads, const Stop& stop);

}  // namespace debulk
