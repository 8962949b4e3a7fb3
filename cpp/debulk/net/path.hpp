#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "debulk/surface/surface.hpp"

namespace debulk {

// How the two initial fibre paths run on from the centre.
enum class PathRule {
  geodesic,        // straight within the surface
  vertical_plane,  // straight seen from above
};

// Where a net may go, in the mold's XY plane.
using NetDomain = std::function<bool(const Eigen::Vector2d&)>;

// Unit vector of the tangent plane at xy whose projection along z has the direction `angle` (radians, counter-clockwise
// from the mold's +x).
Eigen::Vector3d fibre_direction(const Surface& surface, const Eigen::Vector2d& xy, double angle);

// The path of a fibre from a point, integrated in steps of one length as far as it is asked for. Nets of any spacing take their nodes from
// it.
class FibreRay {
 public:
  struct Point {
    Eigen::Vector2d xy;
    Eigen::Vector2d velocity;  // d(xy)/ds, s the arc length on the surface
    Eigen::Vector2d turn;      // d(velocity)/ds along a geodesic
    double height;             // mm; not finite where the surface has ended

    Eigen::Vector3d position() const { return {xy.x(), xy.y(), height}; }
  };

  FibreRay(const Surface& surface, const Eigen::Vector2d& start, double angle, double step, PathRule rule);

  double step() const { return step_; }             // mm of arc
  const Point& at(std::size_t k);                   // k steps from the start
  Point beyond(const Point& from, double h) const;  // a step of length h
 private:
  Point on_surface(const Eigen::Vector2d& xy, const Eigen::Vector2d& velocity) const;
  Eigen::Vector2d turn(const Eigen::Vector2d& xy, const Eigen::Vector2d& velocity) const;

  const Surface& surface_;
  double step_;
  PathRule rule_;
  std::vector<Point> points_;
};

// Steps of the integration to a segment. RK4 at 1/32: about 1e-10 of a segment where the surface's radius is ten segments.
inline constexpr int kStepsPerSegment = 32;

// Nodes along a ray, the start (node 0) first, each at chord distance `spacing` from the one before, to the last one in the region.
// Also ends where the surface does, and where it runs, seen from above, at a right angle to its start: beyond that it turns back.
class RayNodes {
 public:
  RayNodes(FibreRay& ray, double spacing, const NetDomain& region);
  const Eigen::Vector3d* node(std::size_t n);  // none past the last

 private:
  bool lay_next();

  FibreRay& ray_;
  double spacing_;
  const NetDomain& region_;
  std::vector<Eigen::Vector3d> nodes_;
  FibreRay::Point here_;   // the last node
  double arc_ = 0;         // from the start to it
  std::size_t ahead_ = 1;  // the first of the ray's points beyond it
  bool ended_ = false;
};

// The nodes of such a path without its start, at most `limit`.
std::vector<Eigen::Vector3d> fibre_path(const Surface& surface, const Eigen::Vector2d& start, double angle, double spacing, PathRule rule,
                                        const NetDomain& region, long limit);

}  // namespace debulk
