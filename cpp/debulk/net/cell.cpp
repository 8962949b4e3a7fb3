#include "debulk/net/cell.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "debulk/net/bracketed_root.hpp"

namespace debulk {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kLeastOpening = 2 * kDegree;  // of a cell: one that is closer to closing is locked

double cross(const Vector3d& u, const Vector3d& v) {
  return u.x() * v.y() - u.y() * v.x();
}

}  // namespace

std::optional<Vector3d> where_circle_meets(const Surface& surface, const Circle& circle, double spacing) {
  struct {
    double phi, height;
    Vector3d point;
  } last;  // the point at which the gap was last evaluated
  const auto gap = [&](double phi) {
    const Vector3d p = circle.middle + circle.radius * (std::cos(phi) * circle.out + std::sin(phi) * circle.up);
    last = {phi, surface.height(p.head<2>()), p};
    return p.z() - last.height;
  };

  constexpr double march = 0.1;     // rad
  constexpr double farthest = 2.6;  // rad; at pi, a cell's fourth node would be the one opposite to it
  double phi = 0, value = gap(0);
  const double direction = value > 0 ? -march : march;
  double next = 0, next_value = value;
  while (std::isfinite(next_value) && next_value != 0 && (next_value > 0) == (value > 0)) {
    phi = next;
    value = next_value;
    next = phi + direction;
    if (std::abs(next) > farthest) return std::nullopt;
    next_value = gap(next);
  }
  if (!std::isfinite(next_value)) return std::nullopt;
  const double root = next == phi ? phi : bracketed_root(gap, phi, value, next, next_value, 1e-14 * spacing);
  if (root != last.phi) gap(root);
  return Vector3d(last.point.x(), last.point.y(), last.height);
}

std::optional<Vector3d> fourth_node(const Surface& surface, const Vector3d& common, const Vector3d& a, const Vector3d& b, double spacing) {
  // The points at distance `spacing` from both a and b lie on a circle about the chord's middle, and `common` is one of
  // them. Let phi be the angle on the circle, upwards positive, from the point opposite to `common`, which would
  // complete a parallelogram. We look for the point nearest to phi = 0 where the circle meets the surface. This has one
  // unknown instead of (x, y), and the lengths are exact by construction.
  const Vector3d chord = b - a;
  const double opening = 2 * std::asin(std::min(1.0, chord.norm() / (2 * spacing)));
  if (!(opening >= kLeastOpening && opening <= 180 * kDegree - kLeastOpening)) return std::nullopt;
  const Vector3d middle = 0.5 * (a + b), along = chord.normalized();
  const Vector3d away = middle - common;
  const Vector3d out = (away - away.dot(along) * along).normalized();
  Vector3d up = along.cross(out);
  if (up.z() < 0) up = -up;
  return where_circle_meets(surface, {middle, out, up, spacing * std::cos(opening / 2)}, spacing);
}

bool folds_over(const Vector3d& common, const Vector3d& a, const Vector3d& b, const Vector3d& fourth, double side) {
  return cross(a - common, b - common) * side <= 0 || cross(fourth - b, fourth - a) * side <= 0;
}

}  // namespace debulk
