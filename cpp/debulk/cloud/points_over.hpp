#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Marks (1: set) on a grid in the mold's XY plane that belong to their caller, row by row, as in Grid.
struct CellMarks {
  const std::uint8_t* values = nullptr;
  int nx = 0, ny = 0;
  Eigen::Vector2d origin;             // mm
  double spacing = 1.0;               // mm
  bool at(double x, double y) const;  // the mark nearest to a place; false off the grid
};

struct PointsOver {
  std::vector<float> moved;      // three per point, as transform() gives them
  std::vector<std::uint8_t> on;  // one per point
};

// Moves points into the mold's frame, in which they are already if there is no matrix, and says which of them were seen
// over a place that lies in the box and whose nearest marks are all set. One pass in place of ten over as many points as
// the places have. Throws InputError as transform() does, and Stopped.
PointsOver points_over(const CloudView& cloud, const Eigen::Matrix4d* matrix, const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                       const std::vector<CellMarks>& marks, int threads = 0, const Stop& stop = Stop());

}  // namespace debulk
