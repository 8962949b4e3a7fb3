#include "debulk/net/area.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {
namespace {

constexpr double kPoints = 10000;

// Where the horizontal line at y crosses the polygon's sides, ascending: inside between the first and second, ...
std::vector<double> crossings(const Polygon& polygon, double y) {
  std::vector<double> x;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Eigen::Vector2d &a = polygon[k], &b = polygon[k + 1 == polygon.size() ? 0 : k + 1];
    if ((a.y() > y) != (b.y() > y)) x.push_back(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()));
  }
  std::sort(x.begin(), x.end());
  return x;
}

// Whether the ply's edge may run through the box.
bool may_cut(const Polygon& ply, const Box& box) {
  for (std::size_t k = 0; k < ply.size(); ++k) {
    const Eigen::Vector2d &a = ply[k], &b = ply[k + 1 == ply.size() ? 0 : k + 1];
    if ((a.cwiseMin(b).array() <= box.high.array()).all() && (a.cwiseMax(b).array() >= box.low.array()).all()) return true;
  }
  return false;
}

}  // namespace

double surface_area(const Surface& surface, const Polygon& outline, const Polygon& ply_outline) {
  const Polygon polygon = checked_polygon(outline, "outline_mm");
  const Box box = bounding_box(polygon);
  Polygon ply = ply_outline.empty() ? Polygon() : checked_polygon(ply_outline, "ply_outline");
  if (!may_cut(ply, box) && inside(ply, box.low)) ply.clear();  // every point is on it
  const double projected = polygon_area(polygon);
  const double pitch = std::sqrt(projected / kPoints);
  const int rows = std::max(1, static_cast<int>(std::ceil((box.high.y() - box.low.y()) / pitch)));
  const double height = (box.high.y() - box.low.y()) / rows;
  // The mean stretch over the points times the projected area: the outline's own discretisation drops out.
  double stretched = 0, seen = 0;
  std::vector<double> at, widths;
  for (int j = 0; j < rows; ++j) {
    const double y = box.low.y() + (j + 0.5) * height;
    const std::vector<double> x = crossings(polygon, y), edge = crossings(ply, y);
    at.clear(), widths.clear();
    for (std::size_t k = 0; k + 1 < x.size(); k += 2) {
      const int cells = std::max(1, static_cast<int>(std::ceil((x[k + 1] - x[k]) / pitch)));
      const double width = (x[k + 1] - x[k]) / cells;
      seen += cells * width;
      for (int i = 0; i < cells; ++i) {
        const double p = x[k] + (i + 0.5) * width;
        const bool on_ply = (edge.end() - std::upper_bound(edge.begin(), edge.end(), p)) % 2 == 1;  // that many lie beyond it
        if (ply.empty() || on_ply) at.push_back(p), widths.push_back(width);
      }
    }
    const std::vector<Eigen::Vector2d> gradients = surface.gradients_on_row(at, y);
    for (std::size_t k = 0; k < at.size(); ++k) stretched += widths[k] * std::sqrt(1 + gradients[k].squaredNorm());
  }
  return seen > 0 ? projected * stretched / seen : projected;
}

}  // namespace debulk
