#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/scanner/image_stack.hpp"
#include "debulk/scanner/sensor_noise.hpp"
#include "debulk/scanner/unwrap_plan.hpp"

namespace debulk {

// How images become phases. At each number of periods, the grey value of step k is
// offset + modulation cos(phase + 2 pi k / steps).
struct Decoding {
  int steps = 6;
  UnwrapPlan plan;
  double saturated = 255;          // the first grey value that is not to be trusted
  SensorNoise noise;               // of a grey value
  double start = 0;                // phase at the field's edge at every number of periods, turns; orders count from there
  double least_contrast = 5;       // a lit pixel's modulation exceeds this many standard deviations of a grey value
  double most_order_noise = 0.25;  // greatest standard deviation of a sure fringe order, in orders
  double most_residual = 0.35;     // greatest distance of a sure fringe order from a whole number, in orders
  int threads = 0;
  Isa isa = best_isa();
};

constexpr std::uint8_t no_exposure = 255;  // every exposure is saturated

// Maps with one value per pixel. A map whose pointer is null is not computed. The phase, in rad, is that of the first
// number of periods and counts from the start phase over the whole field. Values are NaN where the pixel is dark or saturated in
// every exposure; modulation and offset are NaN only where it is saturated.
struct PhaseMaps {
  float* phase = nullptr;       // rad; -1 - phase where the fringe order is doubtful
  float* noise = nullptr;       // standard deviation of the phase, rad
  float* modulation = nullptr;  // grey levels of the chosen exposure, mean over the numbers of periods
  float* offset = nullptr;      // the same for the offset
  float* residual = nullptr;    // distance of the fringe order from a whole number, 0 to 0.5 (half way to the next)
  std::uint8_t* exposure = nullptr;
};

struct DecodeCounts {
  long lit = 0, saturated = 0;  // numbers of pixels; saturated: in every exposure
  long doubtful = 0;            // number of lit pixels whose fringe order is not sure
  long read = 0;                // number of grey values that were read
  DecodeCounts& operator+=(const DecodeCounts& other);
};

// How much the phase changes if the fringe order is taken one higher, in rad at the first number of periods.
double order_step(const UnwrapPlan& plan);

// What is kept of an exposure's images. Each plane has a value per pixel, and room for whole groups of sixteen pixels.
struct Planes {
  std::array<float*, most_periods> wrapped{};  // wrapped phase of each number of periods, turns
  float* offset = nullptr;                     // sum of the grey values; NaN where a step is saturated
  float* modulation = nullptr;                 // sum over the numbers of periods
};

// What is kept of images that are taken in as they arrive.
struct Arrived {
  Planes best;                       // of each pixel's brightest exposure so far in which no step is saturated
  Planes coming;                     // of the exposure whose images arrive, but for its last number of periods; not for the first
  std::uint8_t* exposure = nullptr;  // the exposure in `best`
};

// Which images are taken in: those of all steps of a number of periods, given by its place among them.
struct Place {
  int exposure = 0, period = 0;
};

// Takes in the steps of one number of periods. All are taken in, in the order of an ImageStack, but the last ones, which
// `decode` adds itself. Throws as `decode` does.
template <class T>
void take_in(const std::vector<const T*>& images, long pixels, const Place& place, const Decoding& how, const Arrived& kept,
             const Stop& stop);

// Decodes each pixel from its brightest exposure in which no step is saturated. Pixels are decoded in groups;
// exposures that no pixel of a group needs are not read. If images were taken in before, only those of the last number of
// periods of the last exposure are read, and all bits of the maps are the same. Throws InputError on a wrong number of
// steps, images, pixels or exposures, and Stopped.
template <class T>
DecodeCounts decode(const ImageStack<T>& stack, const Decoding& how, const PhaseMaps& maps, const Stop& stop,
                    const Arrived* arrived = nullptr);

}  // namespace debulk
