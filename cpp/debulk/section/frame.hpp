#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/section/profile.hpp"

namespace debulk {

// The section's own frame: its origin is the middle of the chord between the pins, x points along the chord and z away
// from the mold. Lengths are in a unit of the order of the fold's height. A tilted mold is level in this frame, with a
// tilted "up".
struct SectionFrame {
  Eigen::Vector2d origin{0, 0}, along{1, 0};  // middle of the chord, mm, and its direction
  double half_span = 0;                       // half the chord, in the unit
  double unit = 1;                            // mm

  Eigen::Vector2d into(const Eigen::Vector2d& point_mm) const { return turned(point_mm - origin, -1) / unit; }
  Eigen::Vector2d out_of(const Eigen::Vector2d& point) const { return origin + unit * turned(point, 1); }  // mm
  Eigen::Vector2d up() const { return turned({0, 1}, -1); }

 private:
  Eigen::Vector2d turned(const Eigen::Vector2d& p, double way) const {
    return {along.x() * p.x() - way * along.y() * p.y(), way * along.y() * p.x() + along.x() * p.y()};
  }
};

// Returns the frame for pins at x = -span / 2 and span / 2 on the mold through `profile` (flat without points), mm.
// Throws InputError for points that are not finite, do not increase in x, or do not reach the pins.
SectionFrame section_frame(double span, double unit, const std::vector<Eigen::Vector2d>& profile);

// Returns the mold in the frame. Throws InputError if the mold overhangs the chord.
SectionProfile section_mold(const SectionFrame& frame, const std::vector<Eigen::Vector2d>& profile);

}  // namespace debulk
