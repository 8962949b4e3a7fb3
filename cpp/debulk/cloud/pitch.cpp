#include "debulk/cloud/pitch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "debulk/cloud/neighbours.hpp"
#include "debulk/core/median.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr std::size_t kAsked = 100'000;  // points of a list, about: their median is known to 0.3 % of the distances' spread

// Median distance from a pixel to the next one that was seen, so many columns and rows or a multiple farther; 0 if there
// is none in most places.
double next_seen(const CloudView& cloud, int columns, int rows) {
  constexpr int kAnchors = 150, kFarthest = 8;
  const int far_columns = kFarthest * columns, far_rows = kFarthest * rows;
  if (cloud.width <= far_columns || cloud.height <= far_rows) return 0;
  const int right = std::max(1, (cloud.width - far_columns) / kAnchors), down = std::max(1, (cloud.height - far_rows) / kAnchors);
  for (int k = 1; k <= kFarthest; ++k) {
    std::vector<float> distances;
    std::size_t seen = 0;
    for (int row = 0; row < cloud.height - far_rows; row += down)
      for (int column = 0; column < cloud.width - far_columns; column += right) {
        const float *p = cloud.point(column, row), *q = cloud.point(column + k * columns, row + k * rows);
        seen += std::isfinite(p[0] + p[1] + p[2]);
        const float d = std::sqrt(squared_distance(p, q));
        if (std::isfinite(d)) distances.push_back(d);
      }
    if (2 * distances.size() > seen) return upper_median(distances);
  }
  return 0;
}

// Share of the squares of this side that hold points, in windows of 4 by 4 with points in all four windows beside each.
double filled_share(const CloudView& cloud, const CloudBounds& box, double side, const Stop& stop) {
  constexpr int kWindow = 4;
  const Eigen::Vector2d size = (box.high - box.low).head<2>() / side;
  const std::size_t columns = static_cast<std::size_t>(size.x()) / kWindow + 1, rows = static_cast<std::size_t>(size.y()) / kWindow + 1;
  if (columns < 3 || rows < 3) return 1;                  // a narrow cloud: nothing is known
  std::vector<std::uint16_t> windows(columns * rows, 0);  // a bit for each of its squares
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (i % 65536 == 0 && stop.now()) throw Stopped("the pitch of a cloud was stopped");
    if (!cloud.seen(i)) continue;
    const auto u = static_cast<std::size_t>((cloud.point(i)[0] - box.low.x()) / side);
    const auto v = static_cast<std::size_t>((cloud.point(i)[1] - box.low.y()) / side);
    windows[v / kWindow * columns + u / kWindow] |= static_cast<std::uint16_t>(1U << (v % kWindow * kWindow + u % kWindow));
  }
  std::size_t inside = 0, filled = 0;
  for (std::size_t v = 1; v + 1 < rows; ++v)
    for (std::size_t u = 1; u + 1 < columns; ++u) {
      const std::uint16_t* at = &windows[v * columns + u];
      if (!at[-1] || !at[1] || !*(at - columns) || !at[columns]) continue;
      ++inside;
      for (unsigned left = *at; left; left &= left - 1) ++filled;
    }
  return inside ? static_cast<double>(filled) / static_cast<double>(inside * kWindow * kWindow) : 0;
}

}  // namespace

double widest_pitch(const CloudView& cloud, double pitch, const Stop& stop) {
  if (cloud.organised()) return std::max({pitch, next_seen(cloud, 1, 0), next_seen(cloud, 0, 1)});
  const CloudBounds box = bounds(cloud, 1);
  if (!(pitch > 0) || !std::isfinite(pitch) || box.seen < 100) return pitch;
  const Eigen::Vector2d size = (box.high - box.low).head<2>() / pitch;
  if (size.prod() > 100.0 * static_cast<double>(box.seen)) return pitch;  // stray points far away; such clouds are refused
  constexpr double kSide = 1.5, kRandom = 0.7, kNearlyAll = 0.9;          // random places fill 0.76 of squares of 1.2/sqrt(density)
  double side = kSide * pitch;
  if (filled_share(cloud, box, side, stop) >= kRandom) return pitch;
  const double most = 0.1 * std::min(box.high.x() - box.low.x(), box.high.y() - box.low.y());
  while (side < most && filled_share(cloud, box, side, stop) < kNearlyAll) side *= 1.2;
  return side;
}

double median_pitch(const CloudView& cloud, int threads, const Stop& stop) {
  std::vector<float> distances;
  if (!cloud.organised()) {
    const auto every = static_cast<std::uint32_t>(std::max<std::size_t>(1, cloud.size() / kAsked));
    for (const float d : mean_neighbour_distances(cloud, 4, threads, stop, every))
      if (std::isfinite(d)) distances.push_back(d);
    return widest_pitch(cloud, upper_median(distances), stop);
  }
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(cloud.size()) / 1e6)));
  const auto taken = [stride](int count) { return static_cast<std::size_t>((count - 2 + stride) / stride); };
  const std::size_t rows = taken(cloud.height), columns = taken(cloud.width);
  distances.resize(2 * rows * columns);
  parallel_for(static_cast<long>(rows), 16, threads, stop, [&](long begin, long end) {
    auto out = distances.begin() + begin * static_cast<long>(2 * columns);
    for (int row = static_cast<int>(begin) * stride; row < static_cast<int>(end) * stride && row + 1 < cloud.height; row += stride)
      for (int column = 0; column + 1 < cloud.width; column += stride) {
        const float *p = cloud.point(column, row), *right = p + 3, *below = cloud.point(column, row + 1);
        for (const float* q : {right, below}) *out++ = std::hypot(q[0] - p[0], q[1] - p[1]);
      }
  });
  distances.erase(std::remove_if(distances.begin(), distances.end(), [](float d) { return !std::isfinite(d); }), distances.end());
  return upper_median(distances);
}

}  // namespace debulk
