#pragma once

#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

struct NeighbourCounts {
  long isolated = 0;  // pixels whose phase was removed although their own order was sure
  long repaired = 0;  // pixels whose doubtful order was decided by the pixels beside them
};

// Compares each phase of a map that `decode` made with its eight neighbours, of which only those count whose order is
// sure. A sure phase stays if at least three of them support it, that is, differ from it by less than half an order;
// wrong orders are rare and isolated. A doubtful phase (stored as -1 - phase) takes the order that at least four
// neighbours ask for, if none asks for another; otherwise it becomes NaN. At the border, two supporters are enough,
// and doubtful phases become NaN. `order_step`: change of the phase for one order more, rad.
NeighbourCounts check_neighbours(float* phase_rad, int width, int height, double order_step, int threads, const Stop& stop,
                                 Isa isa = best_isa());

}  // namespace debulk
