#include "debulk/cloud/pitch.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "debulk/cloud/neighbours.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

double median(std::vector<float>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double median_pitch(const CloudView& cloud, int threads, const Stop& stop) {
  std::vector<float> distances;
  if (!cloud.organised()) {
    for (const float d : mean_neighbour_distances(cloud, 4, threads, stop))
      if (std::isfinite(d)) distances.push_back(d);
    return median(distances);
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
  return median(distances);
}

}  // namespace debulk
