#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// Points [begin, end) of a row that belong together.
struct Run {
  int row, begin, end;
};

// Where `wanted` (0 or anything else) begins and ends along the rows, in order.
std::vector<Run> find_runs(const Grid<std::uint8_t>& image, bool wanted, int threads = 0);

// For each run the first run of its component. `reach`: 1 joins runs that touch diagonally, 0 does not.
std::vector<int> join_runs(const std::vector<Run>& runs, int reach);

}  // namespace debulk
