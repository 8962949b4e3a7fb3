#include "debulk/net/lay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "debulk/core/error.hpp"
#include "debulk/net/bracketed_root.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kLeastCrossing = 10 * kDegree;  // of the two fibres at the centre
constexpr double kLeastOpening = 2 * kDegree;    // of a cell: nearer to closing the net is locked

double cross(const Vector3d& u, const Vector3d& v) {
  return u.x() * v.y() - u.y() * v.x();
}

void check_start(const Surface& surface, const Vector2d& centre, const FibreAngles& angles, double spacing) {
  std::ostringstream place;
  place << "(" << centre.x() << ", " << centre.y() << ")";
  require(centre.allFinite(), "centre_mm", "two finite numbers", place.str());
  require(std::isfinite(angles[0]) && std::isfinite(angles[1]), "angles_deg", "two finite numbers", "NaN or infinity");
  require(std::isfinite(spacing) && spacing > 0, "spacing_mm", "a positive length in mm", spacing);
  require(surface.sample(centre).gradient.allFinite(), "centre_mm", "a point where the surface has a height and a slope", place.str());
  const Vector3d u = fibre_direction(surface, centre, angles[0]), v = fibre_direction(surface, centre, angles[1]);
  const double crossing = std::atan2(u.cross(v).norm(), std::abs(u.dot(v)));
  std::ostringstream came;
  came << crossing / kDegree << " degrees (angles " << angles[0] / kDegree << " and " << angles[1] / kDegree << ")";
  require(crossing >= kLeastCrossing, "angles_deg", "two fibre directions that cross at 10 degrees or more", came.str());
}

}  // namespace

void LayOptions::check() const {
  require(longest_path > 0, "longest_path", "a positive number of nodes", longest_path);
  require(most_nodes > 0, "most_nodes", "a positive number", most_nodes);
}

std::optional<Vector3d> fourth_node(const Surface& surface, const Vector3d& common, const Vector3d& a, const Vector3d& b, double spacing) {
  // Points at the distance from both lie on a circle about the chord's middle, and `common` is one of them. At angle phi from
  // the point opposite to it (the parallelogram's), upwards positive, look for the nearest place where the circle meets the
  // surface. One unknown in place of (x, y), with the lengths exact by construction.
  const Vector3d chord = b - a;
  const double opening = 2 * std::asin(std::min(1.0, chord.norm() / (2 * spacing)));
  if (!(opening >= kLeastOpening && opening <= 180 * kDegree - kLeastOpening)) return std::nullopt;
  const Vector3d middle = 0.5 * (a + b), along = chord.normalized();
  const double radius = spacing * std::cos(opening / 2);
  const Vector3d away = middle - common;
  const Vector3d out = (away - away.dot(along) * along).normalized();
  Vector3d up = along.cross(out);
  if (up.z() < 0) up = -up;
  const auto on_circle = [&](double phi) -> Vector3d { return middle + radius * (std::cos(phi) * out + std::sin(phi) * up); };
  const auto gap = [&](double phi) {
    const Vector3d p = on_circle(phi);
    return p.z() - surface.height(p.head<2>());
  };

  constexpr double march = 0.1;     // rad
  constexpr double farthest = 2.6;  // rad; `common` itself is at pi
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
  Vector3d found = on_circle(next == phi ? phi : bracketed_root(gap, phi, value, next, next_value, 1e-14 * spacing));
  found.z() = surface.height(found.head<2>());
  return found;
}

Lattice lay_net(const Surface& surface, const Vector2d& centre, const FibreAngles& angles, double spacing, const NetDomain& region,
                const LayOptions& options) {
  options.check();
  check_start(surface, centre, angles, spacing);
  const auto check = [&] {
    if (options.stop.now()) throw Stopped("the laying of a net was stopped");
  };
  const double half_turn = 180 * kDegree;
  std::array<std::vector<Vector3d>, 4> paths;  // by Direction
  for (const Direction d : {east, west, north, south}) {
    check();
    const double angle = angles[d / 2] + (d % 2 == 1 ? half_turn : 0.0);
    paths[d] = fibre_path(surface, centre, angle, spacing, options.paths, region, options.longest_path);
    require(static_cast<long>(paths[d].size()) < options.longest_path, "spacing_mm", "a spacing that needs fewer nodes in this region",
            spacing);
  }

  Lattice lattice;
  lattice.spacing = spacing;
  lattice.east = static_cast<int>(paths[east].size());
  lattice.west = -static_cast<int>(paths[west].size());
  lattice.north = static_cast<int>(paths[north].size());
  lattice.south = -static_cast<int>(paths[south].size());
  require(static_cast<long>(lattice.columns()) * lattice.rows() <= options.most_nodes, "spacing_mm",
          "a spacing that needs fewer nodes in this region", spacing);
  lattice.nodes.assign(static_cast<std::size_t>(lattice.columns()) * lattice.rows(),
                       Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  lattice.nodes[lattice.index(0, 0)] = {centre.x(), centre.y(), surface.height(centre)};
  for (int i = 1; i <= lattice.east; ++i) lattice.nodes[lattice.index(i, 0)] = paths[east][i - 1];
  for (int i = 1; i <= -lattice.west; ++i) lattice.nodes[lattice.index(-i, 0)] = paths[west][i - 1];
  for (int j = 1; j <= lattice.north; ++j) lattice.nodes[lattice.index(0, j)] = paths[north][j - 1];
  for (int j = 1; j <= -lattice.south; ++j) lattice.nodes[lattice.index(0, -j)] = paths[south][j - 1];

  const double turn = std::sin(angles[1] - angles[0]);  // its sign: which way round the two fibres cross, seen from above
  for (const int si : {1, -1})
    for (const int sj : {1, -1})
      for (int j = 1; j <= (sj > 0 ? lattice.north : -lattice.south); ++j) {
        check();
        for (int i = 1; i <= (si > 0 ? lattice.east : -lattice.west); ++i) {
          const int ci = si * i, cj = sj * j;
          if (!lattice.has(ci - si, cj - sj) || !lattice.has(ci, cj - sj) || !lattice.has(ci - si, cj)) continue;
          const Vector3d &common = lattice.at(ci - si, cj - sj), &a = lattice.at(ci, cj - sj), &b = lattice.at(ci - si, cj);
          const std::optional<Vector3d> found = fourth_node(surface, common, a, b, spacing);
          if (!found || !region(found->head<2>())) continue;
          const double side = turn * si * sj;
          const bool folded = cross(a - common, b - common) * side <= 0 || cross(*found - b, *found - a) * side <= 0;
          if (!folded) lattice.nodes[lattice.index(ci, cj)] = *found;
        }
      }
  return lattice;
}

NetDomain fibre_parallelogram(const std::vector<Vector2d>& outline, const Vector2d& centre, const FibreAngles& angles, double margin) {
  Eigen::Matrix2d along;
  along << std::cos(angles[0]), std::cos(angles[1]), std::sin(angles[0]), std::sin(angles[1]);
  const Eigen::Matrix2d to_fibres = along.inverse();
  Vector2d low = Vector2d::Zero(), high = Vector2d::Zero();  // the centre belongs to it
  for (const Vector2d& p : outline) {
    const Vector2d q = to_fibres * (p - centre);
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  const double skew = margin / std::abs(along.determinant());
  const Vector2d widening = 0.25 * (high - low) + Vector2d(skew, skew);
  low -= widening;
  high += widening;
  return [=](const Vector2d& p) {
    const Vector2d q = to_fibres * (p - centre);
    return (q.array() >= low.array()).all() && (q.array() <= high.array()).all();
  };
}

}  // namespace debulk
