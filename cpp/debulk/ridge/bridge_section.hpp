#pragma once

#include <optional>

#include "debulk/core/stop.hpp"
#include "debulk/net/lay.hpp"
#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// How high the ply bridges by sections along its fibres. Straight lines a few millimetres apart are measured over the heights of the
// scan; one that is too short is a string over the mold (taut_string.hpp). A net of 100 nodes cannot tell as much: its chords cut
// hollows off, its nodes share the pull of crossing fibres, and a fibre that slips keeps the height that it had when pinned.
struct BridgeSection {
  // mm, of the ply's lower side above the mold, held by no more than friction: as measured, and if the fibre lacked less or more
  // by the error of that and friction held it over 10 mm less or more. 0: it lies down.
  double gap = 0.0, least_gap = 0.0, most_gap = 0.0;
  double lacks = 0.0, error = 0.0;  // mm, by how much the fibre is shorter than its mold, and two standard deviations of it
  double pull = 0.0;                // N/mm, T of a fibre that does not slip; that of an arc of 100 m where no arc lacks as much
  double hold = 0.0;                // N/mm, what friction holds: mu P d, d the way straight on to the ply's edge, of both ends the lesser
};

struct BridgeSectionOptions {
  double friction = 0.4;      // mu
  double pressure = 0.1;      // MPa
  double least_error = 0.04;  // mm, of what a fibre lacks
  Polygon ply;                // its outline
  Box mold_known;             // beyond it the mold is not known
};

// Of the fibre whose least gap is the highest, of the shortest where all lie down; all zero where none is too short. None where the
// ply's outline, or the mold below the pocket, is not known. Throws Stopped.
std::optional<BridgeSection> bridge_section(const FootMap& feet, const Foot& foot, const Surface& mold, const FibreAngles& angles,
                                            const BridgeSectionOptions& options, const Stop& stop = Stop());

}  // namespace debulk
