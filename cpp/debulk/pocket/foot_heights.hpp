#pragma once

#include <cmath>
#include <limits>

#include "debulk/pocket/foot_contours.hpp"

namespace debulk {

// The smoothed heights on the foot of one pocket, interpolated between the grid's points.
class FootHeights {
 public:
  // `feet` is borrowed.
  FootHeights(const FootMap& feet, const Foot& foot) : labels_(feet.labels), heights_(feet.heights), label_(foot.label) {}

  // Whether the nearest point of the grid belongs to the foot. Points of the border do not count, so that there are
  // points on all sides.
  bool on_foot(const Eigen::Vector2d& xy) const {
    const Eigen::Vector2d at = labels_.locate(xy) + Eigen::Vector2d(0.5, 0.5);
    if (!(at.x() >= 1 && at.y() >= 1 && at.x() < labels_.nx - 1 && at.y() < labels_.ny - 1)) return false;
    return labels_.at(static_cast<int>(at.x()), static_cast<int>(at.y())) == label_;
  }
  // Height above the reference at a place on the foot, mm; NaN where one of the four points round it is not known.
  double at(const Eigen::Vector2d& xy) const {
    const Eigen::Vector2d at = heights_.locate(xy);
    const int i = static_cast<int>(at.x()), j = static_cast<int>(at.y());
    const double u = at.x() - i, v = at.y() - j;
    const float* low = &heights_.at(i, j);
    const float* high = low + heights_.nx;
    return (1 - v) * ((1 - u) * low[0] + u * low[1]) + v * ((1 - u) * high[0] + u * high[1]);
  }

  // The same at any place; NaN off the grid.
  double anywhere(const Eigen::Vector2d& xy) const {
    const Eigen::Vector2d at = heights_.locate(xy);
    const bool on_grid = at.x() >= 0 && at.y() >= 0 && at.x() < heights_.nx - 1 && at.y() < heights_.ny - 1;
    return on_grid ? this->at(xy) : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  const Grid<std::int32_t>& labels_;
  const Grid<float>& heights_;
  std::int32_t label_;
};

}  // namespace debulk
