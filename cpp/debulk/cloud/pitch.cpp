#include "debulk/cloud/pitch.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "debulk/cloud/neighbours.hpp"

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
  const auto stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(cloud.size()) / 1e6)));
  for (int row = 0; row + 1 < cloud.height; row += stride)
    for (int column = 0; column + 1 < cloud.width; column += stride) {
      const float *p = cloud.point(column, row), *right = p + 3, *below = cloud.point(column, row + 1);
      for (const float* q : {right, below}) {
        const float d = std::hypot(q[0] - p[0], q[1] - p[1]);
        if (std::isfinite(d)) distances.push_back(d);
      }
    }
  return median(distances);
}

}  // namespace debulk
