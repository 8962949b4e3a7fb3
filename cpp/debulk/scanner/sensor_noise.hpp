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

// Estimates the noise from the images themselves, with each pixel at the brightest exposure that is not saturated. A
// combination of the steps contains no fringe: their highest harmonic, or, with three steps, the difference of the
// means at the first two numbers of periods. A projector's gamma and a lamp that flickers enter it as functions of the
// phase times the modulation. These are fitted to a few hundred neighbouring pixels of a row and taken out; the scatter
// that remains is noise.
template <class T>
SensorNoise estimate_noise(const ImageStack<T>& stack, int steps, double saturated, int width, int threads, const Stop& stop);

}  // namespace debulk
