#pragma once

#include <cmath>
#include <cstddef>

#include <Eigen/Core>

namespace debulk {

// A view of a cloud that belongs to its caller: three floats per point, in mm, row by row as the camera saw them. A
// height (or width) of 1 means unorganised: neighbours in memory need not be neighbours in space. A point with a
// coordinate that is not finite is missing: nothing was seen there.
struct CloudView {
  const float* xyz = nullptr;
  int width = 0;
  int height = 0;

  std::size_t size() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  bool organised() const { return width > 1 && height > 1; }
  const float* point(std::size_t i) const { return xyz + 3 * i; }
  const float* point(int column, int row) const { return point(static_cast<std::size_t>(row) * width + column); }
  // The sum is finite only if all three are (or if it overflows, far outside any scanner's range).
  bool seen(std::size_t i) const { return std::isfinite(point(i)[0] + point(i)[1] + point(i)[2]); }
};

// The box round the points that were seen. If none was seen, the box is empty (low > high).
struct CloudBounds {
  Eigen::Vector3d low, high;  // mm
  long seen = 0;
};

CloudBounds bounds(const CloudView& cloud, int threads = 0);

}  // namespace debulk
