#pragma once

#include "debulk/net/path.hpp"
#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// Returns the largest gap, mm, below a string that is pulled taut over the mold along a fibre of either direction, from
// any point to any other of the outline's inside and of what lies within `around` of it. Whatever the ply's lengths,
// no fibre bridges higher there: a longer fibre hangs lower, and a string over a shorter stretch does, too. The net of a
// pocket reaches one spacing beyond its foot, and the strings over its fibres are among these.
// angles: radians, as seen along z.
double string_bound(const Polygon& outline, double around, const FibreAngles& angles, const Surface& mold);

}  // namespace debulk
