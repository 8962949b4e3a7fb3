#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/pocket/ply_mask.hpp"

namespace debulk {

constexpr double kRingEnd = 1.8;    // radii of a hump: outer edge of the ring round it, which begins at one
constexpr double kRingOff = 0.15;   // of the hump's height: the ring's root mean square off the surface through it, at most
constexpr double kLeastHump = 0.5;  // mm: lower humps make no ridge that counts, unless they are narrower than the cells can show

// Columns and rows from a cell of a map to another: a direction.
struct Way {
  int right, down;
};

// Every 11 degrees.
inline constexpr std::array<Way, 16> kWays{{{1, 0},
                                            {0, 1},
                                            {5, 1},
                                            {-1, 5},
                                            {5, 2},
                                            {-2, 5},
                                            {3, 2},
                                            {-2, 3},
                                            {1, 1},
                                            {-1, 1},
                                            {2, 3},
                                            {-3, 2},
                                            {2, 5},
                                            {-5, 2},
                                            {1, 5},
                                            {-5, 1}}};

// A cell that stands above what surrounds it.
struct HumpTop {
  int i, j;
  std::optional<std::size_t> way;  // of kWays, along which the surface is straight there; none: a quadratic surface surrounds it
};

// The cells that stand highest above what the ring round them predicts, and then those highest above lines through them,
// the highest first. `radius` counts cells. Of each kind at most `most` are returned, of those on the ply.
std::vector<HumpTop> hump_tops(const Grid<float>& map, double radius, const PlyMask& ply, std::size_t most);

}  // namespace debulk
