#include "debulk/cloud/fourth_differences.hpp"

#include <cmath>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

bool repeats(const PointImage& points, int row, int column) {
  const float z = points.pixel(row, column)[2];
  bool same = false;
  for (int down = -1; down <= 1; ++down)
    for (int right = -1; right <= 1; ++right) same |= (down != 0 || right != 0) && points.pixel(row + down, column + right)[2] == z;
  return same;
}

}  // namespace

PixelDifferences fourth_differences(const PointImage& heights, const PointImage& points, int step,
                                    const std::vector<std::array<float, 3>>& axes, int threads, const Stop& stop) {
  PixelDifferences out;
  const auto asked = [step](int pixels) { return pixels > 4 ? (pixels - 5) / step + 1 : 0; };
  out.rows = asked(heights.height), out.columns = asked(heights.width);
  const std::size_t size = static_cast<std::size_t>(out.rows) * static_cast<std::size_t>(out.columns);
  out.apart.resize(2 * axes.size() * size), out.copied.resize(size);
  constexpr long chunk = 8;
  parallel_for(out.rows, chunk, threads, stop, [&](long begin, long end) {
    for (int r = static_cast<int>(begin); r < end; ++r)
      for (int c = 0; c < out.columns; ++c) {
        const int row = 2 + r * step, column = 2 + c * step;
        const std::size_t k = static_cast<std::size_t>(r) * static_cast<std::size_t>(out.columns) + static_cast<std::size_t>(c);
        out.copied[k] = repeats(points, row, column);
        const float* here = heights.pixel(row, column);
        for (std::size_t way = 0; way < 2; ++way) {
          const std::ptrdiff_t one = way == 0 ? heights.row : 3;
          float along[3];
          for (int i = 0; i < 3; ++i) {
            const auto off = [&](std::ptrdiff_t pixels) { return here[pixels * one + i] - here[i]; };
            along[i] = (off(2) + off(-2)) - 4 * (off(1) + off(-1));
          }
          for (std::size_t a = 0; a < axes.size(); ++a) {
            float sum = 0;
            for (std::size_t i = 0; i < 3; ++i)
              if (axes[a][i] != 0) sum += axes[a][i] * along[i];
            out.apart[(2 * a + way) * size + k] = std::abs(sum);
          }
        }
      }
  });
  return out;
}

}  // namespace debulk
