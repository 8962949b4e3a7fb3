#include "debulk/surface/pooled.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "debulk/core/parallel.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

constexpr double pool_mm = 2.0;

// Puts the (count / 2 + 1) lowest of `count` values of each square in front, in order. Value n of square i stands at
// n wide + i.
DEBULK_WIDE void lowest_first(float* values, int count, int wide) {
  for (int place = 0; place <= count / 2; ++place)
    for (int n = count - 1; n > place; --n) {
      float *before = values + static_cast<long>(n - 1) * wide, *after = values + static_cast<long>(n) * wide;
      for (int i = 0; i < wide; ++i) {
        const float a = before[i], b = after[i];
        before[i] = b < a ? b : a, after[i] = b < a ? a : b;
      }
    }
}

}  // namespace

int pool_side(const Grid<float>& values) {
  return std::max(1, static_cast<int>(std::lround(pool_mm / values.spacing)));
}

Grid<float> pooled_medians(const Grid<float>& values, int side, int threads, const Stop& stop) {
  const double middle = (side - 1) / 2.0;
  Grid<float> out((values.nx - 1) / side + 1, (values.ny - 1) / side + 1, values.position(middle, middle), side * values.spacing,
                  std::numeric_limits<float>::quiet_NaN());
  const int each = side * side;
  parallel_for(out.ny, 8, threads, stop, [&](long begin, long end) {
    std::vector<float> row(static_cast<std::size_t>(each) * static_cast<std::size_t>(out.nx));
    std::vector<int> counts;
    for (int j = static_cast<int>(begin); j < end; ++j) {
      // Missing values are put last; a median of fewer values stands before the middle.
      std::fill(row.begin(), row.end(), std::numeric_limits<float>::infinity());
      counts.assign(static_cast<std::size_t>(out.nx), 0);
      for (int y = j * side; y < std::min(values.ny, (j + 1) * side); ++y)
        for (int n = 0; n < side; ++n) {
          float* to = &row[static_cast<std::size_t>((y - j * side) * side + n) * static_cast<std::size_t>(out.nx)];
          for (int x = n, i = 0; x < values.nx; x += side, ++i) {
            const float value = values.at(x, y);
            if (std::isnan(value)) continue;
            counts[static_cast<std::size_t>(i)] += 1;
            to[i] = value;
          }
        }
      lowest_first(row.data(), each, out.nx);
      for (int i = 0; i < out.nx; ++i) {
        const int count = counts[static_cast<std::size_t>(i)];
        if (count > 0 && 4 * count >= each)
          out.at(i, j) = row[static_cast<std::size_t>(count / 2) * static_cast<std::size_t>(out.nx) + static_cast<std::size_t>(i)];
      }
    }
  });
  return out;
}

Grid<std::uint8_t> nodes_near(const Grid<std::uint8_t>& squares, const Grid<double>& nodes, double reach_mm) {
  auto out = nodes.like<std::uint8_t>();
  const int reach = static_cast<int>(std::lround(reach_mm / nodes.spacing));
  for (int j = 0; j < squares.ny; ++j)
    for (int i = 0; i < squares.nx; ++i) {
      if (squares.at(i, j) == 0) continue;
      const Eigen::Vector2d at = nodes.locate(squares.position(i, j));
      const int column = static_cast<int>(std::lround(at.x())), row = static_cast<int>(std::lround(at.y()));
      const int from = std::max(0, column - reach), to = std::min(nodes.nx - 1, column + reach);
      if (from > to) continue;
      for (int b = std::max(0, row - reach); b <= std::min(nodes.ny - 1, row + reach); ++b) std::fill_n(&out.at(from, b), to - from + 1, 1);
    }
  return out;
}

}  // namespace debulk
