#include "debulk/net/path.hpp"

#include <cmath>

#include "debulk/net/bracketed_root.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Steps of the integration to a segment. RK4 at 1/32: about 1e-10 of a segment where the surface's radius is ten segments.
constexpr int kStepsPerSegment = 32;
// A path whose chord does not reach the spacing within this many segments of arc curls up and ends.
constexpr int kLongestArc = 8;

struct PathPoint {
  Vector2d xy;
  Vector2d velocity;  // d(xy)/ds, s the arc length on the surface
};

Vector3d lifted(const Surface& surface, const Vector2d& xy) {
  return {xy.x(), xy.y(), surface.height(xy)};
}

Vector2d at_unit_speed(const Vector2d& velocity, const Vector2d& gradient) {
  const double rise = gradient.dot(velocity);
  return velocity / std::sqrt(velocity.squaredNorm() + rise * rise);
}

// Geodesic of z = F(x, y): x'' = -(x' . H x') grad F / (1 + |grad F|^2), primes by arc length.
PathPoint slope(const Surface& surface, const PathPoint& p) {
  const SurfaceSample s = surface.sample(p.xy);
  const double bend = p.velocity.dot(s.hessian * p.velocity) / (1 + s.gradient.squaredNorm());
  return {p.velocity, -bend * s.gradient};
}

PathPoint moved(const PathPoint& p, double h, const PathPoint& along) {
  return {p.xy + h * along.xy, p.velocity + h * along.velocity};
}

PathPoint geodesic_step(const Surface& surface, const PathPoint& p, double h) {
  const PathPoint k1 = slope(surface, p);
  const PathPoint k2 = slope(surface, moved(p, h / 2, k1));
  const PathPoint k3 = slope(surface, moved(p, h / 2, k2));
  const PathPoint k4 = slope(surface, moved(p, h, k3));
  const Vector2d xy = p.xy + h / 6 * (k1.xy + 2 * k2.xy + 2 * k3.xy + k4.xy);
  const Vector2d velocity = p.velocity + h / 6 * (k1.velocity + 2 * k2.velocity + 2 * k3.velocity + k4.velocity);
  return {xy, at_unit_speed(velocity, surface.sample(xy).gradient)};
}

// The curve's projection is straight, so a step of any length stays on it: only its arc length is approximate.
PathPoint plane_step(const Surface& surface, const PathPoint& p, double h) {
  const Vector2d xy = p.xy + h * p.velocity;
  return {xy, at_unit_speed(p.velocity, surface.sample(xy).gradient)};
}

}  // namespace

Vector3d fibre_direction(const Surface& surface, const Vector2d& xy, double angle) {
  const Vector2d seen(std::cos(angle), std::sin(angle));
  return Vector3d(seen.x(), seen.y(), surface.sample(xy).gradient.dot(seen)).normalized();
}

std::vector<Vector3d> fibre_path(const Surface& surface, const Vector2d& start, double angle, double spacing, PathRule rule,
                                 const NetDomain& region, long limit) {
  const auto step = rule == PathRule::geodesic ? geodesic_step : plane_step;
  const double h = spacing / kStepsPerSegment;
  std::vector<Vector3d> nodes;
  PathPoint here{start, fibre_direction(surface, start, angle).head<2>()};
  const Vector2d first_way = here.velocity;
  Vector3d last = lifted(surface, start);
  while (static_cast<long>(nodes.size()) < limit) {
    const auto excess = [&](const PathPoint& p) { return (lifted(surface, p.xy) - last).norm() - spacing; };
    double before = -spacing, after = -spacing;
    PathPoint ahead = here;
    for (int k = 0; k < kLongestArc * kStepsPerSegment && after < 0; ++k) {
      here = ahead;
      before = after;
      ahead = step(surface, here, h);
      after = excess(ahead);
    }
    if (!(after >= 0)) break;  // curled up, or left the surface (NaN)
    const auto excess_after = [&](double part) { return excess(step(surface, here, part)); };
    here = step(surface, here, bracketed_root(excess_after, 0.0, before, h, after, 1e-14 * spacing));
    if (!region(here.xy) || here.velocity.dot(first_way) <= 0) break;  // turned back, it would lay a second net over the first
    last = lifted(surface, here.xy);
    nodes.push_back(last);
  }
  return nodes;
}

}  // namespace debulk
