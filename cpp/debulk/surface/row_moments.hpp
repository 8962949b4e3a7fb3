#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/fit_sums.hpp"

namespace debulk {

// Where the nodes lie: every `step` cells from `first_i`, `first_j`, from at or just before the grid's border to at or
// just behind it.
struct FitNodes {
  int step, nx, ny, first_i, first_j;

  FitNodes(const Grid<float>& heights, double spacing);
};

// The weights along one axis of the window, times powers of the coordinate.
struct FitWindow {
  int reach;
  std::vector<std::array<double, 5>> powers;  // w x^a at [d + reach]
  std::array<double, 5> all{};                // their sums

  explicit FitWindow(int r);
  const std::array<double, 5>& at(int d) const { return powers[static_cast<std::size_t>(d + reach)]; }
};

// Memory for the sums of one window after another: new pages take longer than the sums in them.
struct RowMemory {
  std::unique_ptr<double[]> sums, weights;
  std::size_t size = 0;

  void hold(std::size_t count);
};

// Sums over the rows of the heights, for the window of each node: of w x^a, a = 0 ... 4, of w x^a z, a = 0 ... 2, and of
// w z². Heights, nodes, window and memory must outlive them.
class RowMoments {
 public:
  // Only what the wanted nodes need is summed up, kTogether nodes at once; all, if `wanted` is empty.
  RowMoments(const Grid<float>& heights, const FitNodes& nodes, const FitWindow& window, const Grid<std::uint8_t>& wanted,
             RowMemory& memory, int threads, const Stop& stop);

  // Whether the rows [low, high] are complete, for each of kTogether nodes from node i, a multiple of kTogether.
  std::array<std::uint8_t, kTogether> all_complete(int i, int low, int high) const;
  // The sums of window_sums for these nodes, of the rows [low, high] in a window round the row `middle`.
  void add_up(int i, int low, int high, int middle, double* out) const;
  // The sums of window_weights for them.
  void add_up_weights(int i, int low, int high, int middle, double* out) const;

 private:
  std::size_t at(int i, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(wide_) + static_cast<std::size_t>(i);
  }
  // The place of a row's sums, of which there are so many.
  std::size_t place(std::size_t sums, int i, int row, std::size_t which = 0) const {
    return (sums * static_cast<std::size_t>(row) + which) * static_cast<std::size_t>(wide_) + static_cast<std::size_t>(i);
  }
  bool needed(int i, int begin, int end) const;
  void read_rows(int begin, int end);

  const Grid<float>& heights_;
  const FitNodes& nodes_;
  const FitWindow& window_;
  const Grid<std::uint8_t>& wanted_;
  int wide_;
  std::vector<double> powers_;
  std::vector<std::uint8_t> complete_;
  double *sums_, *weights_;  // of each row kSums and kWeights times those of all nodes
};

}  // namespace debulk
