#pragma once

#include "debulk/core/stop.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {

// Sets phases to NaN that fewer than `least` of the eight pixels round them support: a pixel supports another where their
// phases differ by less than half a period. A wrong fringe order differs by a period at least, and wrong orders are rare and
// lie alone. Returns how many went.
long remove_isolated(float* phase_rad, int width, int height, int least, int threads, const Stop& stop, Isa isa = best_isa());

}  // namespace debulk
