#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/stop.hpp"

namespace debulk {

// Points that were asked row by row: fourth_differences() gives all but the last array. They belong to their caller.
struct AskedPoints {
  int ways = 0, rows = 0, columns = 0;  // ways: two for each axis
  const float* apart = nullptr;         // (ways, rows, columns)
  const std::uint8_t* copied = nullptr;
  const std::uint8_t* on_ply = nullptr;
};

// As `Limits` of inspection/rawscan/vouched.py, where each has its source.
struct MadeLimits {
  double quiet, wild, least_mm, made, rarest, least_share;
  int window_cells;
};

// Which points software made of their neighbours; one value per point.
struct MadePoints {
  bool noisy = false;    // false: the scan has too little noise to miss it anywhere, and the rest is empty
  bool rounded = false;  // depths were rounded so coarsely that a lack of noise shows nothing
  std::vector<std::uint8_t> made;
  std::vector<std::uint8_t> marks;  // (3, rows, columns): quiet along an axis both ways, a copy on the ply, wild both ways
};

// Of each way, differences are quiet or wild against their median over the ply. A point is made if those in the window
// around it are likelier made than measured: a naive Bayes classifier by the shares of odd and of quiet points in the whole
// scan. All sums are counts, so that they are exact. `step_mm` is that to which depths were rounded, or 0. Throws Stopped.
MadePoints made_points(const AskedPoints& asked, double step_mm, const MadeLimits& limits, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
