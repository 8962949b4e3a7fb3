#pragma once

#include <cstdint>

#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/scanner/image_stack.hpp"
#include "debulk/scanner/sensor_noise.hpp"
#include "debulk/scanner/unwrap_plan.hpp"

namespace debulk {

// How images become phases. Grey value of step k at one number of periods: offset + modulation cos(phase + 2 pi k / steps).
struct Decoding {
  int steps = 6;
  UnwrapPlan plan;
  double saturated = 255;          // the first grey value that is not to be trusted
  SensorNoise noise;               //
  double least_contrast = 5;       // modulation of a lit pixel, in standard deviations of a grey value
  double most_order_noise = 0.25;  // standard deviation of a sure fringe order, in orders
  double most_residual = 0.35;     // of a sure fringe order: its distance to a whole number, in orders
  int threads = 0;
  Isa isa = best_isa();
};

constexpr std::uint8_t no_exposure = 255;  // every exposure is saturated

// A value for each pixel; a null pointer is not wanted. NaN: dark or saturated.
struct PhaseMaps {
  float* phase = nullptr;       // rad of the first number of periods, from 0 over the whole field; -1 less it where doubtful
  float* noise = nullptr;       // its standard deviation, rad
  float* modulation = nullptr;  // levels of the chosen exposure, mean over the numbers of periods
  float* offset = nullptr;      // likewise
  float* residual = nullptr;    // the fringe order's distance to a whole number, 0 to 0.5: 0.5 is half way to the next one
  std::uint8_t* exposure = nullptr;
};

struct DecodeCounts {
  long lit = 0, saturated = 0;  // pixels; saturated: in every exposure
  long doubtful = 0;            // lit, and the order not sure
  long read = 0;                // grey values that were read
  DecodeCounts& operator+=(const DecodeCounts& other);
};

// How the phase changes where the fringe order is taken one higher, rad of the first number of periods.
double order_step(const UnwrapPlan& plan);

// Every pixel from its brightest exposure that no step saturates; exposures that no pixel of a group needs are not read.
template <class T>
DecodeCounts decode(const ImageStack<T>& stack, const Decoding& how, const PhaseMaps& maps, const Stop& stop);

}  // namespace debulk
