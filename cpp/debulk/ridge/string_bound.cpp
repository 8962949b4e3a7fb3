#include "debulk/ridge/string_bound.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/ridge/taut_string.hpp"

namespace debulk {
namespace {

// Of `around`: distance from line to line, and from point to point on one. A net has its fibres, and reads the mold
// below them, at least twice as far apart.
constexpr double kApart = 1.0 / 6, kStep = 1.0 / 24;

// The lowest and the highest coordinate along a line of what is nearer to it, across it, than `around`; corners: of the
// outline, along and across the line. Empty (low above high) if nothing is.
Eigen::Vector2d stretch_beside(const Polygon& corners, double across, double around) {
  Eigen::Vector2d out(std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const Eigen::Vector2d &a = corners[k], &b = corners[k + 1 == corners.size() ? 0 : k + 1];
    const double from = std::max(std::min(a.y(), b.y()), across - around), to = std::min(std::max(a.y(), b.y()), across + around);
    if (from > to) continue;
    for (const double y : {from, to}) {
      const double share = a.y() == b.y() ? 0.0 : (y - a.y()) / (b.y() - a.y());
      const double x = a.x() + share * (b.x() - a.x());
      for (const double at : {x, a.y() == b.y() ? b.x() : x}) out = {std::min(out[0], at), std::max(out[1], at)};
    }
  }
  return out;
}

}  // namespace

double string_bound(const Polygon& outline, double around, const FibreAngles& angles, const Surface& mold) {
  require(around > 0, "around_mm", "a positive length in mm", around);
  double bound = 0;
  for (const double angle : {angles[0], angles[1]}) {
    const Eigen::Vector2d way(std::cos(angle), std::sin(angle)), side(-way.y(), way.x());
    Polygon corners;
    corners.reserve(outline.size());
    for (const Eigen::Vector2d& p : outline) corners.emplace_back(p.dot(way), p.dot(side));
    const Box box = bounding_box(corners);
    MoldSection section;
    section.step = kStep * around;
    for (double y = box.low.y() - around; y <= box.high.y() + (1 + kApart) * around; y += kApart * around) {
      const Eigen::Vector2d stretch = stretch_beside(corners, y, around);
      if (stretch[0] > stretch[1]) continue;
      section.heights.clear();
      for (double x = stretch[0] - around; x <= stretch[1] + around + section.step; x += section.step)
        section.heights.push_back(mold.height(x * way + y * side));
      bound = std::max(bound, taut_string(section, std::numeric_limits<double>::infinity()).gap);
    }
  }
  return bound;
}

}  // namespace debulk
