#include "debulk/net/generator_cells.hpp"

#include <cmath>
#include <cstdlib>

#include <Eigen/Geometry>

#include "debulk/net/bracketed_root.hpp"
#include "debulk/net/cell.hpp"
#include "debulk/net/net.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double angle_between(const Vector3d& u, const Vector3d& v) {
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

}  // namespace

GeneratorCells::GeneratorCells(const Surface& surface, const Vector2d& centre, const FibreAngles& angles, double spacing,
                               const NetDomain& region)
    : surface_(surface), region_(region), spacing_(spacing) {
  const double turn = std::sin(angles[1] - angles[0]) > 0 ? 1 : -1;
  const Vector3d u = fibre_direction(surface, centre, angles[0]), v = fibre_direction(surface, centre, angles[1]);
  const double crossing = angle_between(u, v), straight = std::acos(-1.0);
  arms_[east] = {{}, -turn, crossing, true};
  arms_[west] = {{}, turn, straight - crossing, true};
  arms_[north] = {{}, turn, crossing, true};
  arms_[south] = {{}, -turn, straight - crossing, true};

  const Vector3d origin(centre.x(), centre.y(), surface.height(centre));
  const Vector3d up = (Vector3d::UnitZ() - v.z() * v).normalized();
  const auto second = where_circle_meets(surface, {origin, v, up, spacing}, spacing);
  if (!second || !region_(second->head<2>())) return;
  arms_[east].rungs = {{origin, *second}};
  if (!extend(arms_[east])) return;
  const Rung& across = arms_[east].rungs[1];  // from the central cell, all four arms are known to begin
  arms_[west].rungs = arms_[east].rungs;
  arms_[west].rungs.pop_back();
  arms_[south].rungs = {{origin, across.first}};
  arms_[north].rungs = {{origin, across.first}, {*second, across.second}};
  for (Arm& arm : arms_) arm.ended = false;
}

const Vector3d* GeneratorCells::node(int i, int j) {
  const bool along_first = j == 0 || j == 1;
  Arm& arm = arms_[along_first ? (i >= 0 ? east : west) : (j > 0 ? north : south)];
  const auto number = static_cast<std::size_t>(std::abs(along_first ? i : j));
  while (arm.rungs.size() <= number && !arm.ended) arm.ended = !extend(arm);
  if (arm.rungs.size() <= number) return nullptr;
  const Rung& rung = arm.rungs[number];
  return (along_first ? j : i) == 0 ? &rung.first : &rung.second;
}

bool GeneratorCells::extend(Arm& arm) const {
  const std::optional<Rung> found = next(arm);
  if (!found || !region_(found->first.head<2>()) || !region_(found->second.head<2>())) return false;
  const Rung& last = arm.rungs.back();
  if (folds_over(last.first, found->first, last.second, found->second, -arm.side)) return false;
  if (arm.rungs.size() > 1) {  // an arm that turned back would lay a second net over the first
    const Vector3d start = arm.rungs[1].first - arm.rungs[0].first;
    if ((found->first - last.first).head<2>().dot(start.head<2>()) <= 0) return false;
  }
  arm.rungs.push_back(*found);
  return true;
}

std::optional<GeneratorCells::Rung> GeneratorCells::next(const Arm& arm) const {
  const Rung& last = arm.rungs.back();
  // All sides of a cell are equal, so opposite corners have equal angles. The signed shear of the four corners sums to 0
  // if the angles at the rung's two ends differ by as much as in a cell that does not shear.
  std::optional<Rung> rung;
  const auto excess = [&](double heading) {
    rung = rung_beyond(last, arm, heading);
    if (!rung) return std::nan("");
    const Vector3d across = last.second - last.first;
    const double at_first = angle_between(rung->first - last.first, across);
    const double at_second = angle_between(rung->second - last.second, -across);
    return at_first - at_second - (2 * arm.angle - std::acos(-1.0));
  };
  constexpr double farthest = 1.0;  // rad from the heading that an even surface would ask for
  constexpr double tolerance = 1e-13;
  double here = arm.angle, value = excess(here), ahead = here, next_value = value;
  // In an even cell, half the excess is the change of heading that is missing.
  for (double step = -0.5 * value; std::isfinite(next_value) && next_value != 0 && (next_value > 0) == (value > 0); step *= 2) {
    here = ahead, value = next_value;
    if (std::abs(value) <= tolerance) return rung;
    ahead = here + step;
    if (std::abs(ahead - arm.angle) > farthest) return std::nullopt;
    next_value = excess(ahead);
  }
  if (!std::isfinite(next_value)) return std::nullopt;
  if (next_value == 0) return rung;
  const double left = excess(bracketed_root(excess, here, value, ahead, next_value, tolerance));
  constexpr double small = 1e-9;  // rad; more is left only if cells in between cannot be laid
  return std::abs(left) <= small ? rung : std::nullopt;
}

std::optional<GeneratorCells::Rung> GeneratorCells::rung_beyond(const Rung& last, const Arm& arm, double heading) const {
  const Vector2d slope = surface_.sample(last.first.head<2>()).gradient;
  const Vector3d normal = Vector3d(-slope.x(), -slope.y(), 1).normalized();
  if (!normal.allFinite()) return std::nullopt;
  const Vector3d across = last.second - last.first;
  const Vector3d in_plane = (across - across.dot(normal) * normal).normalized();
  const Vector3d out = std::cos(heading) * in_plane + std::sin(heading) * arm.side * normal.cross(in_plane);
  const auto first = where_circle_meets(surface_, {last.first, out, normal, spacing_}, spacing_);
  if (!first) return std::nullopt;
  const auto second = fourth_node(surface_, last.first, *first, last.second, spacing_);
  if (!second) return std::nullopt;
  return Rung{*first, *second};
}

}  // namespace debulk
