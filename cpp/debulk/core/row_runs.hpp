#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// The points [begin, end) of one row that belong together.
struct Run {
  int row, begin, end;
};

// Writes the runs of a row, given from left to right as bit masks of 16 columns each (the last mask may have fewer).
class RunWriter {
 public:
  RunWriter(std::vector<Run>& to, int row) : to_(to), row_(row) {}
  void add(int column, unsigned bits, int columns = 16) {
    const unsigned whole = (1u << columns) - 1;
    unsigned changes = (bits ^ (bits << 1 | (open_ ? 1u : 0u))) & whole;
    for (; changes != 0; changes &= changes - 1) {
      const int at = column + __builtin_ctz(changes);
      if (open_) to_.push_back({row_, begin_, at});
      begin_ = at, open_ = !open_;
    }
  }
  void end(int column) {
    if (open_) to_.push_back({row_, begin_, column});
  }

 private:
  std::vector<Run>& to_;
  int row_, begin_ = 0;
  bool open_ = false;
};

// Collects runs that are found in strips of rows, each strip by one thread, and puts them together in order. Reuses
// its memory.
class StripRuns {
 public:
  static constexpr int rows = 64;  // per strip
  void clear(int image_rows);
  std::vector<Run>& strip(long first_row) { return strips_[static_cast<std::size_t>(first_row / rows)]; }
  const std::vector<Run>& join();

 private:
  std::vector<std::vector<Run>> strips_;
  std::vector<Run> runs_;
};

// The runs of points that are nonzero (`wanted` is true) or zero (`wanted` is false), row by row and from left to
// right.
std::vector<Run> find_runs(const Grid<std::uint8_t>& image, bool wanted, int threads = 0);

// For each run the index of the first run of its component. With `reach` 1, runs that touch diagonally are joined;
// with 0 they are not.
std::vector<int> join_runs(const std::vector<Run>& runs, int reach);
void join_runs(const std::vector<Run>& runs, int reach, std::vector<int>& parent);  // the same, in reused memory

}  // namespace debulk
