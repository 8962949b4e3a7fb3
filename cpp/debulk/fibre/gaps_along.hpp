#pragma once

#include <vector>

#include "debulk/core/stop.hpp"
#include "debulk/fibre/fibre_lines.hpp"
#include "debulk/fibre/gap_tiles.hpp"

namespace debulk {

// The points [first, end) of a line.
struct Stretch {
  int first = 0, end = 0;
};

// Joins stretches of a line, in order, that follow each other.
template <class S>
void join(std::vector<S>& stretches) {
  if (stretches.empty()) return;
  std::size_t kept = 0;
  for (std::size_t k = 1; k < stretches.size(); ++k)
    if (stretches[k].first == stretches[kept].end)
      stretches[kept].end = stretches[k].end;
    else
      stretches[++kept] = stretches[k];
  stretches.resize(kept + 1);
}

// Points of a line in one tile with values, or, once they are joined, in several.
struct RaisedStretch : Stretch {
  std::size_t at = 0;      // of its first value
  std::int32_t tile = -1;  // the tile's number
};

// What a line crosses, in order; elsewhere the ply lies flat.
struct LineCourse {
  std::vector<RaisedStretch> raised;
  std::vector<Stretch> unknown;
};

// What is read at a point of a line: the ply's lower side above the mold by either mean, NaN where it is not known, and
// the mold, mm; and the slope of the coarser mean across the line, to its left.
struct PointGaps {
  float fine, coarse, mold, aside;
};

// The gaps along all lines, read where the ply stands off the mold or next to it. Each tile is made once, and its
// points of all lines are read while its values are in the cache.
struct GapsAlong {
  std::vector<LineCourse> courses;  // of each line
  const PointGaps* points = nullptr;

  // whole: beyond the heights nothing is known; otherwise the ply lies flat there. The points lie in `memory`, which
  // grows as needed. Throws Stopped.
  static GapsAlong of(const std::vector<FibreLine>& lines, const GapTiles& tiles, const Surface& mold, bool whole,
                      const FibreOptions& options, std::vector<PointGaps>& memory, const Stop& stop);
};

// The points of a line that may lie in a box.
Stretch points_within(const FibreLine& line, const Box& box);

}  // namespace debulk
