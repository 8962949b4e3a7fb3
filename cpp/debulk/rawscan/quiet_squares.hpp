#pragma once

#include <cstdint>
#include <vector>

#include "debulk/rawscan/quiet_limits.hpp"

namespace debulk {

// Marks with 1 the squares that carry no noise along one of the axes, as a scanner's own software leaves them where it
// filled in a hole or clipped heights. All others are 0. Throws Stopped.
std::vector<std::uint8_t> quiet_squares(const SquareLattice& lattice, const std::vector<QuietLimits>& limits, int threads = 0,
                                        const Stop& stop = Stop());

}  // namespace debulk
