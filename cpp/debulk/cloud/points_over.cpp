#include "debulk/cloud/points_over.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/cloud/transform.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {

bool CellMarks::at(double x, double y) const {
  const double column = std::nearbyint((x - origin.x()) / spacing), row = std::nearbyint((y - origin.y()) / spacing);
  if (!(column >= 0 && row >= 0 && column < nx && row < ny)) return false;
  return values[static_cast<std::size_t>(row) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(column)] != 0;
}

PointsOver points_over(const CloudView& cloud, const Eigen::Matrix4d* matrix, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                       const std::vector<CellMarks>& marks, int threads, const Stop& stop) {
  PointsOver out;
  if (matrix != nullptr)
    out.moved = transform(cloud, *matrix, threads, stop);
  else
    out.moved.assign(cloud.xyz, cloud.xyz + 3 * cloud.size());
  out.on.resize(cloud.size());
  constexpr long chunk = 1 << 13;
  parallel_for(static_cast<long>(cloud.size()), chunk, threads, stop, [&](long begin, long end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
      const double x = out.moved[3 * k], y = out.moved[3 * k + 1];
      out.on[k] = x >= low.x() && x <= high.x() && y >= low.y() && y <= high.y() && std::isfinite(out.moved[3 * k + 2]) &&
                  std::all_of(marks.begin(), marks.end(), [x, y](const CellMarks& one) { return one.at(x, y); });
    }
  });
  return out;
}

}  // namespace debulk
