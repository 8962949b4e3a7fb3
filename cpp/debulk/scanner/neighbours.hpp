#pragma once

#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

struct NeighbourCounts {
  long isolated = 0;  // pixels whose phase went, though their own order was sure
  long repaired = 0;  // doubtful orders that the pixels beside them decided
};

// Holds the phases of a map that `decode` made against the eight beside each, of which those count whose order is sure.
// A sure phase stays where at least three of them support it, by less than half an order; wrong orders are rare and lie
// alone. A doubtful one (-1 less the phase) takes the order that at least four of them ask for, none asking for another, or
// goes. `order_step`: what one order more does to the phase, rad.
NeighbourCounts check_neighbours(float* phase_rad, int width, int height, double order_step, int threads, const Stop& stop,
                                 Isa isa = best_isa());

}  // namespace debulk
