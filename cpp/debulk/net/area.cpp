#include "debulk/net/area.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {
namespace {

constexpr double kPoints = 10000;

// Rows of points, one at the middle of each of `count` strips from `low` on.
struct Rows {
  double low, height;
  int count;
  double y(int j) const { return low + (j + 0.5) * height; }
};

// Returns the x at which each row crosses the polygon's sides, ascending: a point is inside between the first and the
// second, the third and the fourth, and so on. Every side is visited once, for the few rows that it may cross.
std::vector<std::vector<double>> crossings(const Polygon& polygon, const Rows& rows) {
  std::vector<std::vector<double>> x(static_cast<std::size_t>(rows.count));
  const auto row_near = [&](double y) { return static_cast<int>(std::clamp((y - rows.low) / rows.height, -2.0, rows.count + 2.0)); };
  for_sides(polygon, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const int first = std::max(0, row_near(std::min(a.y(), b.y())) - 1);
    const int last = std::min(rows.count - 1, row_near(std::max(a.y(), b.y())) + 1);
    for (int j = first; j <= last; ++j) {
      const double y = rows.y(j);
      if ((a.y() > y) != (b.y() > y)) x[static_cast<std::size_t>(j)].push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
    }
  });
  for (std::vector<double>& row : x) std::sort(row.begin(), row.end());
  return x;
}

// Whether the ply's edge may run through the box.
bool may_cut(const Polygon& ply, const Box& box) {
  bool may = false;
  for_sides(ply, [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    may |= (a.cwiseMin(b).array() <= box.high.array()).all() && (a.cwiseMax(b).array() >= box.low.array()).all();
  });
  return may;
}

}  // namespace

double surface_area(const Surface& surface, const Polygon& outline, const Polygon& ply_outline) {
  const Polygon polygon = checked_polygon(outline, "outline_mm");
  const Box box = bounding_box(polygon);
  Polygon ply = ply_outline.empty() ? Polygon() : checked_polygon(ply_outline, "ply_outline");
  if (!may_cut(ply, box) && inside(ply, box.low)) ply.clear();  // every point of the box is on the ply
  const double projected = polygon_area(polygon);
  const double pitch = std::sqrt(projected / kPoints);
  const int count = std::max(1, static_cast<int>(std::ceil((box.high.y() - box.low.y()) / pitch)));
  const Rows rows{box.low.y(), (box.high.y() - box.low.y()) / count, count};
  const std::vector<std::vector<double>> sides = crossings(polygon, rows), edges = crossings(ply, rows);
  // The result is the mean stretch over the points times the projected area, so that the outline's own discretisation
  // cancels.
  double stretched = 0, seen = 0;
  std::vector<double> at, widths;
  for (int j = 0; j < count; ++j) {
    const std::vector<double>&x = sides[static_cast<std::size_t>(j)], &edge = edges[static_cast<std::size_t>(j)];
    at.clear(), widths.clear();
    for (std::size_t k = 0; k + 1 < x.size(); k += 2) {
      const int cells = std::max(1, static_cast<int>(std::ceil((x[k + 1] - x[k]) / pitch)));
      const double width = (x[k + 1] - x[k]) / cells;
      seen += cells * width;
      for (int i = 0; i < cells; ++i) {
        const double p = x[k] + (i + 0.5) * width;
        const bool on_ply =
            (edge.end() - std::upper_bound(edge.begin(), edge.end(), p)) % 2 == 1;  // an odd number of the ply's sides lies beyond p
        if (ply.empty() || on_ply) at.push_back(p), widths.push_back(width);
      }
    }
    const std::vector<Eigen::Vector2d> gradients = surface.gradients_on_row(at, rows.y(j));
    for (std::size_t k = 0; k < at.size(); ++k) stretched += widths[k] * std::sqrt(1 + gradients[k].squaredNorm());
  }
  return seen > 0 ? projected * stretched / seen : projected;
}

}  // namespace debulk
