#include "debulk/net/path.hpp"

#include <cmath>

#include "debulk/net/bracketed_root.hpp"

namespace debulk {

using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

// A path ends if its chord does not reach the spacing within this many segments of arc, because it curls up.
constexpr int kLongestArc = 8;

}  // namespace

Vector3d fibre_direction(const Surface& surface, const Vector2d& xy, double angle) {
  const Vector2d seen(std::cos(angle), std::sin(angle));
  return Vector3d(seen.x(), seen.y(), surface.sample(xy).gradient.dot(seen)).normalized();
}

FibreRay::FibreRay(const Surface& surface, const Vector2d& start, double angle, double step, PathRule rule)
    : surface_(surface), step_(step), rule_(rule), points_{on_surface(start, {std::cos(angle), std::sin(angle)})} {}

// Geodesic of z = F(x, y): x'' = -(x' . H x') grad F / (1 + |grad F|^2), where primes are derivatives by arc length.
FibreRay::Point FibreRay::on_surface(const Vector2d& xy, const Vector2d& velocity) const {
  const SurfaceSample s = surface_.sample(xy);
  const double rise = s.gradient.dot(velocity);
  const Vector2d at_unit_speed = velocity / std::sqrt(velocity.squaredNorm() + rise * rise);
  const double bend = at_unit_speed.dot(s.hessian * at_unit_speed) / (1 + s.gradient.squaredNorm());
  return {xy, at_unit_speed, -bend * s.gradient, s.height};
}

Vector2d FibreRay::turn(const Vector2d& xy, const Vector2d& velocity) const {
  const SurfaceSample s = surface_.sample(xy);
  return -velocity.dot(s.hessian * velocity) / (1 + s.gradient.squaredNorm()) * s.gradient;
}

FibreRay::Point FibreRay::beyond(const Point& p, double h) const {
  // The curve of a vertical plane is straight seen from above, so a step of any length stays on it; only its arc length
  // is approximate.
  if (rule_ == PathRule::vertical_plane) return on_surface(p.xy + h * p.velocity, p.velocity);
  const Vector2d v2 = p.velocity + h / 2 * p.turn, a2 = turn(p.xy + h / 2 * p.velocity, v2);
  const Vector2d v3 = p.velocity + h / 2 * a2, a3 = turn(p.xy + h / 2 * v2, v3);
  const Vector2d v4 = p.velocity + h * a3, a4 = turn(p.xy + h * v3, v4);
  return on_surface(p.xy + h / 6 * (p.velocity + 2 * v2 + 2 * v3 + v4), p.velocity + h / 6 * (p.turn + 2 * a2 + 2 * a3 + a4));
}

const FibreRay::Point& FibreRay::at(std::size_t k) {
  while (points_.size() <= k) points_.push_back(beyond(points_.back(), step_));
  return points_[k];
}

RayNodes::RayNodes(FibreRay& ray, double spacing, const NetDomain& region)
    : ray_(ray), spacing_(spacing), region_(region), nodes_{ray.at(0).position()}, here_(ray.at(0)) {}

const Vector3d* RayNodes::node(std::size_t n) {
  while (nodes_.size() <= n)
    if (!lay_next()) return nullptr;
  return &nodes_[n];
}

bool RayNodes::lay_next() {
  const Vector3d last = nodes_.back();
  const auto excess = [&](const FibreRay::Point& p) { return (p.position() - last).norm() - spacing_; };
  const double h = ray_.step(), farthest = arc_ + kLongestArc * spacing_;
  FibreRay::Point from = here_;
  double from_arc = arc_, before = -spacing_, after = ended_ ? std::nan("") : -spacing_;
  while (after < 0 && from_arc < farthest) {
    const FibreRay::Point& next = ray_.at(ahead_);
    after = excess(next);
    if (!(after < 0)) break;
    from = next, before = after;
    from_arc = static_cast<double>(ahead_++) * h;
  }
  ended_ = !(after >= 0);  // curled up, or left the surface (NaN)
  if (ended_) return false;
  const double width = static_cast<double>(ahead_) * h - from_arc;
  const auto excess_after = [&](double part) { return excess(ray_.beyond(from, part)); };
  const double part = bracketed_root(excess_after, 0.0, before, width, after, 1e-14 * spacing_);
  here_ = ray_.beyond(from, part);
  arc_ = from_arc + part;
  // A path that turned back would lay a second net over the first.
  ended_ = !region_(here_.xy) || here_.velocity.dot(ray_.at(0).velocity) <= 0;
  if (!ended_) nodes_.push_back(here_.position());
  return !ended_;
}

}  // namespace debulk
