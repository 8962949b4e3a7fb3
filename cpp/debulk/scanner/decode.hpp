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

// What remains of the brightest exposure's images once they were taken in, in less memory than they need. Each plane
// has a value per pixel, and room for a whole number of groups of sixteen pixels.
struct Arrived {
  std::array<float*, most_periods> wrapped{};  // wrapped phase of each number of periods, turns
  float* offset = nullptr;                     // sum of the grey values; NaN where a step is saturated
  float* modulation = nullptr;                 // sum over the numbers of periods
};

// Takes in the images of all steps of one number of periods, given by its place among them. All are taken in, in order.
// Throws as `decode` does.
template <class T>
void take_in(const std::vector<const T*>& images, long pixels, int period, const Decoding& how, const Arrived& into, const Stop& stop);

// Decodes each pixel from its brightest exposure in which no step is saturated. Pixels are decoded in groups;
// exposures that no pixel of a group needs are not read. Images of the brightest exposure that were taken in before are
// not read again, and all bits are the same. Throws InputError on a wrong number of steps, images, pixels or exposures,
// and Stopped.
template <class T>
DecodeCounts decode(const ImageStack<T>& stack, const Decoding& how, const PhaseMaps& maps, const Stop& stop,
                    const Arrived* arrived = nullptr);

}  // namespace debulk
