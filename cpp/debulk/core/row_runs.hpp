#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"

namespace debulk {

// Points [begin, end) of a row that belong together.
struct Run {
  int row, begin, end;
};

// Writes the runs of a row from masks of 16 columns (or less, the last) at once, from left to right.
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

// Runs that are found in strips of rows, each by one thread, and then put together in order. Keeps its memory.
class StripRuns {
 public:
  static constexpr int rows = 64;  // of a strip
  void clear(int image_rows);
  std::vector<Run>& strip(long first_row) { return strips_[static_cast<std::size_t>(first_row / rows)]; }
  const std::vector<Run>& join();

 private:
  std::vector<std::vector<Run>> strips_;
  std::vector<Run> runs_;
};

// Where `wanted` (0 or anything else) begins and ends along the rows, in order.
std::vector<Run> find_runs(const Grid<std::uint8_t>& image, bool wanted, int threads = 0);

// For each run the first run of its component. `reach`: 1 joins runs that touch diagonally, 0 does not.
std::vector<int> join_runs(const std::vector<Run>& runs, int reach);
void join_runs(const std::vector<Run>& runs, int reach, std::vector<int>& parent);  // the same, into memory that is kept

}  // namespace debulk
