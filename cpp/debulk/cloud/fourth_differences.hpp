#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "debulk/core/stop.hpp"

namespace debulk {

// An image of points, or a part of a wider one: three floats per pixel, and so many floats from row to row.
struct PointImage {
  const float* first = nullptr;
  std::ptrdiff_t row = 0;
  int width = 0, height = 0;
  const float* pixel(int down, int right) const { return first + down * row + 3 * static_cast<std::ptrdiff_t>(right); }
};

// What every `step`-th pixel along rows and columns shows of how it was made, but for two at each end; row by row.
struct PixelDifferences {
  int rows = 0, columns = 0;
  // Sizes of the fourth differences along the image's columns, then along its rows, of the coordinates along each of the
  // axes: their share that no surface has which is smooth over five pixels. NaN where one of these was not seen.
  std::vector<float> apart;
  std::vector<std::uint8_t> copied;  // 1: one of the eight pixels beside has the same z, bit for bit
};

// Coordinates are those of `heights`, and z that of `points`, an image of the same size, or the same one. Differences are
// taken first, because these are exact: single precision would round sums of coordinates. Throws Stopped.
PixelDifferences fourth_differences(const PointImage& heights, const PointImage& points, int step,
                                    const std::vector<std::array<float, 3>>& axes, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
