#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
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

// For the windows of kTogether neighbouring nodes of each row of nodes, a strip of the grid: the sums over each row of
// heights of w x^a z, a = 0 ... 2, of w z², and of w x^a, a = 0 ... 4, of what is missing. Outside the grid all is
// missing. Most rows are complete, and the sums of a strip fit into a cache.
class StripMoments {
 public:
  // Only what the wanted nodes need is summed up; all, if `wanted` is empty. The window must outlive the sums.
  void read(const Grid<float>& heights, const FitNodes& nodes, const FitWindow& window, int first_node, const Grid<std::uint8_t>& wanted);

  // The sums of window_sums for these nodes, of the rows [low, high] in a window round the row `middle`.
  void add_up(int low, int high, int middle, double* out) const;
  // The sums of y^b w x^a over what is known there, a + b <= 4, for each a all b. Bit k of the answer is set if nothing
  // is missing in the window of node k.
  unsigned add_up_weights(int low, int high, int middle, double* out) const;

 private:
  void mark_needed(const FitNodes& nodes, int first_node, const Grid<std::uint8_t>& wanted);
  void read_rows(const Grid<float>& heights, const FitNodes& nodes, int first_node, int begin, int end);

  const FitWindow* window_ = nullptr;
  std::vector<std::uint8_t> needed_;     // rows
  std::vector<double> sums_;             // of each row kSums times kTogether
  std::vector<int> incomplete_;          // rows in which something is missing
  std::vector<std::uint8_t> complete_;   // of these, bit by bit, the nodes for which nothing is
  std::vector<double> missing_;          // of these kWeights times kTogether
  std::vector<float> beyond_;            // rows of a strip that reaches beyond the grid
  std::vector<double> columns_, holes_;  // kTogether rows side by side
};

}  // namespace debulk
