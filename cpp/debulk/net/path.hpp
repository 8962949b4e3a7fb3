#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "debulk/surface/surface.hpp"

namespace debulk {

// The rule by which a net continues from the centre along its two fibres.
enum class PathRule {
  geodesic,        // paths that are straight within the surface
  vertical_plane,  // paths that are straight seen from above
  least_shear,     // strips of cells that shear least (generator_cells.hpp)
};

// Directions of the two fibres as seen along z, radians, counter-clockwise from the mold's +x. The fibres lie in the
// tangent plane.
using FibreAngles = std::array<double, 2>;

// Returns whether a net may contain a point of the mold's XY plane.
using NetDomain = std::function<bool(const Eigen::Vector2d&)>;

// Returns the unit vector in the tangent plane at xy whose projection along z has the direction `angle` (radians,
// counter-clockwise from the mold's +x).
Eigen::Vector3d fibre_direction(const Surface& surface, const Eigen::Vector2d& xy, double angle);

// The path of a fibre from a point, integrated in steps of equal length as far as it is asked for. Nets of any spacing
// take their nodes from it.
class FibreRay {
 public:
  struct Point {
    Eigen::Vector2d xy;
    Eigen::Vector2d velocity;  // d(xy)/ds, where s is the arc length on the surface
    Eigen::Vector2d turn;      // d(velocity)/ds along a geodesic
    double height;             // mm; not finite where the surface has ended

    Eigen::Vector3d position() const { return {xy.x(), xy.y(), height}; }
  };

  FibreRay(const Surface& surface, const Eigen::Vector2d& start, double angle, double step, PathRule rule);

  double step() const { return step_; }             // mm of arc
  const Point& at(std::size_t k);                   // the point k steps from the start
  Point beyond(const Point& from, double h) const;  // the point a step of length h beyond `from`
 private:
  Point on_surface(const Eigen::Vector2d& xy, const Eigen::Vector2d& velocity) const;
  Eigen::Vector2d turn(const Eigen::Vector2d& xy, const Eigen::Vector2d& velocity) const;

  const Surface& surface_;
  double step_;
  PathRule rule_;
  std::vector<Point> points_;
};

// Integration steps per segment. With RK4 at 1/32 the error is about 1e-10 of a segment where the surface's radius is
// ten segments.
inline constexpr int kStepsPerSegment = 32;

// Nodes along a ray, from the start (node 0) to the last one in the region, each at chord distance `spacing` from the
// one before. The row also ends where the surface ends, and where the path, seen from above, is at a right angle to its
// start: beyond that it would turn back.
class RayNodes {
 public:
  RayNodes(FibreRay& ray, double spacing, const NetDomain& region);
  const Eigen::Vector3d* node(std::size_t n);  // null past the last

 private:
  bool lay_next();

  FibreRay& ray_;
  double spacing_;
  const NetDomain& region_;
  std::vector<Eigen::Vector3d> nodes_;
  FibreRay::Point here_;   // the last node
  double arc_ = 0;         // arc length from the start to here_, mm
  std::size_t ahead_ = 1;  // the first of the ray's points beyond it
  bool ended_ = false;
};

}  // namespace debulk
