#include "debulk/pocket/hump_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/surface/median.hpp"

namespace debulk {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Grid<float> means(const Grid<float>& seen, int step) {
  const double half = 0.5 * (step - 1);
  Grid<float> out(seen.nx / step, seen.ny / step, seen.position(half, half), step * seen.spacing, kNan);
  for (int j = 0; j < out.ny; ++j)
    for (int i = 0; i < out.nx; ++i) {
      double sum = 0;
      int count = 0;
      for (int b = 0; b < step; ++b) {
        const float* row = &seen.at(i * step, j * step + b);
        for (int a = 0; a < step; ++a)
          if (std::isfinite(row[a])) sum += row[a], ++count;
      }
      if (count > 0 && 2 * count >= step * step) out.at(i, j) = static_cast<float>(sum / count);
    }
  return out;
}

}  // namespace

Grid<float> hump_map(const Grid<float>& seen, double cell) {
  return median(means(seen, std::max(1, static_cast<int>(std::lround(cell / seen.spacing)))), 3, 1);
}

Grid<float> part_of(const Grid<float>& map, const Box& box, int margin) {
  const auto begin = [&](double at, int n) { return static_cast<int>(std::clamp(std::floor(at) - margin, 0.0, double(n))); };
  const auto end = [&](double at, int n) { return static_cast<int>(std::clamp(std::ceil(at) + margin + 1, 0.0, double(n))); };
  const Eigen::Vector2d low = map.locate(box.low), high = map.locate(box.high);
  const int left = begin(low.x(), map.nx), bottom = begin(low.y(), map.ny);
  Grid<float> out(std::max(0, end(high.x(), map.nx) - left), std::max(0, end(high.y(), map.ny) - bottom), map.position(left, bottom),
                  map.spacing);
  for (int j = 0; j < out.ny && out.nx > 0; ++j) std::copy_n(&map.at(left, bottom + j), out.nx, &out.at(0, j));
  return out;
}

double between(const Grid<float>& map, double column, double row) {
  const int i = static_cast<int>(std::floor(column)), j = static_cast<int>(std::floor(row));
  const double x = column - i, y = row - j;
  double sum = 0, share = 0;
  for (int b = 0; b <= 1; ++b)
    for (int a = 0; a <= 1; ++a) {
      if (!map.contains(i + a, j + b) || !std::isfinite(map.at(i + a, j + b))) continue;
      const double weight = (a == 0 ? 1 - x : x) * (b == 0 ? 1 - y : y);
      sum += weight * map.at(i + a, j + b), share += weight;
    }
  return share >= 0.5 ? sum / share : kNan;
}

}  // namespace debulk
