#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/fibre/fibre_options.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// A line along a fibre, as points `step` apart in the mold's XY plane: straight from `first` along `way`, or through
// `points` where the angles vary. It ends at the ply's edge, or where nothing beyond it is known.
struct FibreLine {
  int family = 0;  // 0: along the first fibre; 1: along the second
  Eigen::Vector2d first = Eigen::Vector2d::Zero(), way = Eigen::Vector2d::UnitX();
  int count = 0;                        // of its points
  std::vector<Eigen::Vector2f> points;  // empty: the line is straight
  double step = 1.0;                    // mm
  std::array<bool, 2> to_edge{};        // whether its first and its last end lie at the ply's edge

  Eigen::Vector2d at(int k) const {
    return points.empty() ? Eigen::Vector2d(first + k * step * way) : points[static_cast<std::size_t>(k)].cast<double>();
  }
  double length() const { return (count - 1) * step; }
};

// Directions of the two fibres as seen along z, radians, on a grid; NaN where nothing is known.
using AngleField = Grid<Eigen::Vector2d>;

// Returns the lines of both families over the ply, the first family first, each family from one side to the other. The
// lines of constant angles are straight, and a line that leaves an outline and enters it again is several. The lines of
// a field of angles follow it from seeds on a raster of `apart`, until every cell of the raster has been crossed.
// ply: outline; empty: all of the box is ply, and the ends of its lines are unknown. Throws InputError and Stopped.
std::vector<FibreLine> straight_lines(const std::array<double, 2>& angles, const Polygon& ply, const Box& box, const FibreOptions& options);
std::vector<FibreLine> field_lines(const AngleField& angles, const Polygon& ply, const Box& box, const FibreOptions& options,
                                   const Stop& stop = Stop());

}  // namespace debulk
