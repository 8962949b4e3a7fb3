#pragma once

#include <vector>

#include "debulk/core/stop.hpp"
#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// The height at which the ply bridges: each fibre that is too short is treated as a string over the mold
// (taut_string.hpp). A net of 100 nodes is less accurate: its chords cut off hollows, its nodes share the pull of
// crossing fibres, and a fibre that slips keeps the height that it had when pinned.
struct BridgeSection {
  // mm, height of the ply's lower side above the mold when only friction holds it; 0: it lies down. `least_gap` is for a
  // fibre that is too short by its error less, `most_gap` for the most, held by friction over 10 mm less or more.
  double gap = 0.0, least_gap = 0.0, most_gap = 0.0;
  double lacks = 0.0, error = 0.0;  // mm, by how much the fibre is shorter than its mold, and two standard deviations of that
  double pull = 0.0;                // N/mm, T of a fibre that does not slip; at most that of an arc with a radius of 100 m
  double hold = 0.0;                // N/mm, held by friction: mu P d, where d is the shorter distance, straight on, to the ply's edge
};

// A fibre over a place, off the mold from one point to another, mold XY, mm.
struct ShortFibre {
  Eigen::Vector2d from, to;
  double lacks = 0.0, error = 0.0;  // mm, as above
  double most = 0.0;                // mm, by which a part of it may be too short if the rest feeds nothing; at least lacks + error
};

struct BridgeSectionOptions {
  double friction = 0.4;  // mu
  double pressure = 0.1;  // MPa
  Polygon ply;            // outline of the ply; empty: not known, and the ply ends where the mold does
  Box mold_known;         // the mold is known inside this box only
};

// Returns the section of the fibre with the highest least_gap or, if all lie down, of the one that is too short by most,
// with the largest most_gap of all; all zero if no fibre is too short. Throws Stopped.
BridgeSection bridge_section(const std::vector<ShortFibre>& fibres, const Surface& mold, const BridgeSectionOptions& options,
                             const Stop& stop = Stop());

}  // namespace debulk
