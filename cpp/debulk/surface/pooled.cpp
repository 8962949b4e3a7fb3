#include "debulk/surface/pooled.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr double pool_mm = 2.0;

}  // namespace

int pool_side(const Grid<float>& values) {
  return std::max(1, static_cast<int>(std::lround(pool_mm / values.spacing)));
}

Grid<float> pooled_medians(const Grid<float>& values, int side, int threads, const Stop& stop) {
  const double middle = (side - 1) / 2.0;
  Grid<float> out((values.nx - 1) / side + 1, (values.ny - 1) / side + 1, values.position(middle, middle), side * values.spacing,
                  std::numeric_limits<float>::quiet_NaN());
  parallel_for(out.ny, 8, threads, stop, [&](long begin, long end) {
    std::vector<float> square;
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < out.nx; ++i) {
        square.clear();
        for (int y = j * side; y < std::min(values.ny, (j + 1) * side); ++y)
          for (int x = i * side; x < std::min(values.nx, (i + 1) * side); ++x)
            if (const float value = values.at(x, y); !std::isnan(value)) square.push_back(value);
        if (square.empty() || 4 * static_cast<int>(square.size()) < side * side) continue;
        const auto half = square.begin() + static_cast<long>(square.size() / 2);
        std::nth_element(square.begin(), half, square.end());
        out.at(i, j) = *half;
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
      for (int b = std::max(0, row - reach); b <= std::min(nodes.ny - 1, row + reach); ++b)
        for (int a = std::max(0, column - reach); a <= std::min(nodes.nx - 1, column + reach); ++a) out.at(a, b) = 1;
    }
  return out;
}

}  // namespace debulk
