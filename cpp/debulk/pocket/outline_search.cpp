#include "debulk/pocket/outline_search.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/pocket/cross.hpp"

namespace debulk {

OutlineSearch::OutlineSearch(const Polygon& polygon) : polygon_(polygon) {
  for_sides(polygon_, [this](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { sides_.push_back({a, b}); });
  for (std::size_t first = 0; first < sides_.size(); first += group) {
    Box box{sides_[first][0], sides_[first][0]};
    for (std::size_t k = first; k < std::min(first + group, sides_.size()); ++k)
      for (const Eigen::Vector2d& p : sides_[k]) box.low = box.low.cwiseMin(p), box.high = box.high.cwiseMax(p);
    boxes_.push_back(box);
  }
}

bool OutlineSearch::inside(const Eigen::Vector2d& point) const {
  bool odd = false;
  for (std::size_t g = 0; g < boxes_.size(); ++g) {
    if (boxes_[g].low.y() > point.y() || boxes_[g].high.y() < point.y() || boxes_[g].high.x() + 1e-6 < point.x()) continue;
    for (std::size_t k = g * group; k < std::min((g + 1) * group, sides_.size()); ++k) {
      const auto& [a, b] = sides_[k];
      odd ^= is_crossed(a, b, point);
    }
  }
  return odd;
}

OutlineSearch::Nearest OutlineSearch::nearest(const Eigen::Vector2d& point, Nearest best) const {
  const auto try_group = [&](std::size_t g) {
    for (std::size_t k = g * group; k < std::min((g + 1) * group, sides_.size()); ++k) {
      const Eigen::Vector2d at = nearest_on(sides_[k][0], sides_[k][1], point);
      if (const double squared = (at - point).squaredNorm(); squared < best.squared) best = {squared, at};
    }
  };
  const auto clearance = [&](std::size_t g) {
    const Eigen::Vector2d away = (boxes_[g].low - point).cwiseMax(point - boxes_[g].high).cwiseMax(0.0);
    return away.squaredNorm();
  };
  std::size_t first = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t g = 0; g < boxes_.size(); ++g)
    if (const double c = clearance(g); c < least) least = c, first = g;
  constexpr double rounding = 1 + 1e-9;  // of the clearances and of the squares
  if (!boxes_.empty() && least <= best.squared * rounding) try_group(first);
  for (std::size_t g = 0; g < boxes_.size(); ++g)
    if (g != first && clearance(g) <= best.squared * rounding) try_group(g);
  return best;
}

double OutlineSearch::distance(const Eigen::Vector2d& point) const {
  return std::sqrt(nearest(point, {}).squared);
}

Eigen::Vector2d OutlineSearch::nearest_point(const Eigen::Vector2d& point) const {
  return nearest(point, {}).at;
}

bool OutlineSearch::within(const Eigen::Vector2d& point, double reach) const {
  // Distances above the reach need not be known: nearest() then returns this bound, whose root is above the reach.
  const double farther = reach * reach * (1 + 1e-9) + std::numeric_limits<double>::min();
  return !empty() && std::sqrt(nearest(point, {farther, point}).squared) <= reach;
}

double OutlineSearch::way_out(const Eigen::Vector2d& from, const Eigen::Vector2d& direction) const {
  if (!inside(from)) return 0.0;
  double way = std::numeric_limits<double>::infinity();
  for (std::size_t g = 0; g < boxes_.size(); ++g) {
    // A box that is clear of the line, by more than rounding, has no side that crosses it.
    const Eigen::Vector2d half = 0.5 * (boxes_[g].high - boxes_[g].low), middle = 0.5 * (boxes_[g].low + boxes_[g].high) - from;
    if (std::abs(cross(middle, direction)) > half.x() * std::abs(direction.y()) + half.y() * std::abs(direction.x()) + 1e-6) continue;
    for (std::size_t k = g * group; k < std::min((g + 1) * group, sides_.size()); ++k) {
      const Eigen::Vector2d before = sides_[k][0] - from, here = sides_[k][1] - from;
      const double beside_before = cross(before, direction), beside = cross(here, direction);
      // Skip a side whose ends lie on the same side of the line.
      if (beside * beside_before > 0 || beside == beside_before) continue;
      const Eigen::Vector2d side = here - before;
      const double along = cross(before, side) / cross(direction, side);
      if (along >= 0) way = std::min(way, along);
    }
  }
  return way < std::numeric_limits<double>::infinity() ? way : 0.0;
}

}  // namespace debulk
