#include "debulk/pocket/outline_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace debulk {

OutlineSearch::OutlineSearch(const Polygon& polygon) : polygon_(polygon) {
  for (std::size_t first = 0; first < polygon_.size(); first += group) {
    Box box{polygon_[first], polygon_[first]};
    for (std::size_t k = first + 1; k <= std::min(first + group, polygon_.size()); ++k) {
      const Eigen::Vector2d& p = polygon_[k == polygon_.size() ? 0 : k];
      box.low = box.low.cwiseMin(p), box.high = box.high.cwiseMax(p);
    }
    boxes_.push_back(box);
  }
}

bool OutlineSearch::inside(const Eigen::Vector2d& point) const {
  bool odd = false;
  for (std::size_t g = 0; g < boxes_.size(); ++g) {
    if (boxes_[g].low.y() > point.y() || boxes_[g].high.y() < point.y() || boxes_[g].high.x() + 1e-6 < point.x()) continue;
    for (std::size_t k = g * group; k < std::min((g + 1) * group, polygon_.size()); ++k) {
      const Eigen::Vector2d &a = polygon_[k], &b = polygon_[k + 1 == polygon_.size() ? 0 : k + 1];
      if ((a.y() > point.y()) == (b.y() > point.y())) continue;
      const double x = a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      if (point.x() < x) odd = !odd;
    }
  }
  return odd;
}

double OutlineSearch::nearest(const Eigen::Vector2d& point, double squared) const {
  const auto try_group = [&](std::size_t g) {
    for (std::size_t k = g * group; k < std::min((g + 1) * group, polygon_.size()); ++k) {
      const Eigen::Vector2d &a = polygon_[k], &b = polygon_[k + 1 == polygon_.size() ? 0 : k + 1];
      const Eigen::Vector2d side = b - a;
      const double length2 = side.squaredNorm();
      const double t = length2 > 0 ? std::clamp((point - a).dot(side) / length2, 0.0, 1.0) : 0.0;
      squared = std::min(squared, (a + t * side - point).squaredNorm());
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
  if (!boxes_.empty() && least <= squared * rounding) try_group(first);
  for (std::size_t g = 0; g < boxes_.size(); ++g)
    if (g != first && clearance(g) <= squared * rounding) try_group(g);
  return squared;
}

double OutlineSearch::distance(const Eigen::Vector2d& point) const {
  return std::sqrt(nearest(point, std::numeric_limits<double>::infinity()));
}

bool OutlineSearch::within(const Eigen::Vector2d& point, double reach) const {
  return !empty() && distance(point) <= reach;
}

}  // namespace debulk
