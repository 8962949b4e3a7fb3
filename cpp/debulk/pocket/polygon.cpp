#include "debulk/pocket/polygon.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/pocket/cross.hpp"
#include "debulk/pocket/outline_search.hpp"

namespace debulk {

std::vector<Ring> rings(const Polygon& polygon) {
  std::vector<Ring> out;
  std::size_t begin = 0;
  for (std::size_t k = 3; k < polygon.size(); ++k)
    if (k >= begin + 3 && polygon[k] == polygon[begin]) out.push_back({begin, k}), begin = k + 1;
  if (begin < polygon.size()) out.assign(1, {0, polygon.size()});
  return out;
}

// Sums are taken relative to the first corner, because far from the origin the products would cancel.
double polygon_area(const Polygon& polygon) {
  double twice = 0;
  for_sides(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { twice += cross(a - polygon[0], b - polygon[0]); });
  return twice / 2;
}

Eigen::Vector2d polygon_centroid(const Polygon& polygon) {
  Eigen::Vector2d moment = Eigen::Vector2d::Zero(), mean = Eigen::Vector2d::Zero();
  if (polygon.empty()) return mean;
  double twice = 0;
  const Eigen::Vector2d first = polygon[0];
  for_sides(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const double w = cross(a - first, b - first);
    twice += w;
    moment += w * (a - first + b - first) / 3;
    mean += a - first;
  });
  if (twice == 0) return first + mean / static_cast<double>(polygon.size());
  return first + moment / twice;
}

double polygon_perimeter(const Polygon& polygon) {
  double length = 0;
  for_sides(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { length += (b - a).norm(); });
  return length;
}

bool inside(const Polygon& polygon, const Eigen::Vector2d& point) {
  bool odd = false;
  for_sides(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { odd ^= is_crossed(a, b, point); });
  return odd;
}

double distance_to_outline(const Polygon& polygon, const Eigen::Vector2d& point) {
  double squared = std::numeric_limits<double>::infinity();
  for_sides(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    squared = std::min(squared, (nearest_on(a, b, point) - point).squaredNorm());
  });
  return std::sqrt(squared);
}

Box bounding_box(const Polygon& polygon) {
  Box box;
  if (polygon.empty()) return box;
  box.low = box.high = polygon[0];
  for (const Eigen::Vector2d& p : polygon) {
    box.low = box.low.cwiseMin(p);
    box.high = box.high.cwiseMax(p);
  }
  return box;
}

Eigen::Vector2d deepest_point(const Polygon& polygon) {
  constexpr int kAcross = 24, kFinerTimes = 4;  // a grid over the box, then finer ones round its best point
  const Box box = bounding_box(polygon);
  Eigen::Vector2d best = polygon_centroid(polygon), size = box.high - box.low;
  const OutlineSearch outline(polygon);
  double depth = outline.inside(best) ? outline.distance(best) : 0;
  for (int finer = 0; finer < kFinerTimes; ++finer) {
    const Eigen::Vector2d low = finer == 0 ? box.low : Eigen::Vector2d(best - size / 2);
    for (int j = 0; j <= kAcross; ++j)
      for (int i = 0; i <= kAcross; ++i) {
        const Eigen::Vector2d p = low + size.cwiseProduct(Eigen::Vector2d(i, j) / kAcross);
        if (!outline.inside(p)) continue;
        const double d = outline.distance(p);
        if (d > depth) depth = d, best = p;
      }
    size *= 3.0 / kAcross;
  }
  return best;
}

Polygon rounded(Polygon polygon) {
  constexpr double fine = 1048576.0;
  for (Eigen::Vector2d& p : polygon) p = (p.array() * fine).round() / fine;
  return polygon;
}

Polygon checked_polygon(Polygon polygon, const char* argument) {
  for (std::size_t k = 0; k < polygon.size(); ++k)
    if (!polygon[k].allFinite())
      require(false, argument, "finite coordinates", "corner " + std::to_string(k) + " with a value that is not finite");
  while (polygon.size() > 1 && polygon.front() == polygon.back()) polygon.pop_back();
  require(polygon.size() >= 3, argument, "a polygon of at least 3 different corners", std::to_string(polygon.size()) + " corners");
  const double area = polygon_area(polygon);
  require(area != 0, argument, "a polygon with an area", "corners on one line");
  if (area < 0) std::reverse(polygon.begin(), polygon.end());
  return polygon;
}

}  // namespace debulk
