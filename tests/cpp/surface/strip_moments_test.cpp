#include "debulk/surface/strip_moments.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace debulk {
namespace {

// A grid with a hole, a row and single points missing; its last rows and nodes do not fill a strip.
Grid<float> with_holes() {
  Grid<float> out(83, 45, {3, 4}, 0.5);
  for (int j = 0; j < out.ny; ++j)
    for (int i = 0; i < out.nx; ++i) {
      const bool hole = std::hypot(i - 30, j - 20) < 4 || j == 40 || (i * 7 + j * 13) % 101 == 0;
      out.at(i, j) = hole ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(std::sin(0.1 * i) + 0.02 * j * j);
    }
  return out;
}

struct Sums {
  double weights[5][5] = {}, heights[3][3] = {}, squares = 0;
  bool complete = true;
};

// Height by height.
Sums of_window(const Grid<float>& heights, int middle_i, int middle_j, const FitWindow& window) {
  Sums out;
  for (int y = -window.reach; y <= window.reach; ++y)
    for (int x = -window.reach; x <= window.reach; ++x) {
      const float z = heights.contains(middle_i + x, middle_j + y) ? heights.at(middle_i + x, middle_j + y) : std::nanf("");
      if (std::isnan(z)) {
        out.complete = false;
        continue;
      }
      const auto &wx = window.at(x), &wy = window.at(y);
      for (std::size_t a = 0; a < 5; ++a)
        for (std::size_t b = 0; a + b < 5; ++b) out.weights[a][b] += wx[a] * wy[b];
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; a + b < 3; ++b) out.heights[b][a] += wx[a] * wy[b] * static_cast<double>(z);
      out.squares += wx[0] * wy[0] * static_cast<double>(z) * static_cast<double>(z);
    }
  return out;
}

TEST(StripMoments, AreTheSumsOfEachNodesWindow) {
  const Grid<float> heights = with_holes();
  const FitNodes nodes(heights, 2.0);
  StripMoments moments;
  int complete_windows = 0, others = 0;
  for (const int reach : {2, 5, 12})
    for (const int wanted_row : {-1, 3}) {
      const FitWindow window(reach);
      Grid<std::uint8_t> wanted;
      if (wanted_row >= 0) {
        wanted = Grid<std::uint8_t>(nodes.nx, nodes.ny, {0, 0}, 2.0);
        for (int i = 0; i < nodes.nx; ++i) wanted.at(i, wanted_row) = 1;
      }
      for (int first = 0; first < nodes.nx; first += kTogether) {
        moments.read(heights, nodes, window, first, wanted);
        for (int j = 0; j < nodes.ny; ++j) {
          if (wanted_row >= 0 && j != wanted_row) continue;
          const int middle = nodes.first_j + j * nodes.step, low = std::max(0, middle - reach),
                    high = std::min(heights.ny - 1, middle + reach);
          double found[kSquareSums * kTogether], weights[kSquareWeights * kTogether];
          moments.add_up(low, high, middle, found);
          const unsigned complete = moments.add_up_weights(low, high, middle, weights);
          for (int k = 0; k < std::min(kTogether, nodes.nx - first); ++k) {
            const Sums expected = of_window(heights, nodes.first_i + (first + k) * nodes.step, middle, window);
            const double *height = found + k, *weight = weights + k;
            for (std::size_t b = 0; b < 3; ++b)
              for (std::size_t a = 0; a + b < 3; ++a, height += kTogether) EXPECT_NEAR(*height, expected.heights[b][a], 1e-9);
            EXPECT_NEAR(*height, expected.squares, 1e-7);
            for (std::size_t a = 0; a < 5; ++a)
              for (std::size_t b = 0; a + b < 5; ++b, weight += kTogether) EXPECT_NEAR(*weight, expected.weights[a][b], 1e-11);
            EXPECT_EQ((complete >> k & 1U) != 0, expected.complete);
            ++(expected.complete ? complete_windows : others);
          }
        }
      }
    }
  EXPECT_GT(complete_windows, 50);
  EXPECT_GT(others, 50);
}

}  // namespace
}  // namespace debulk
