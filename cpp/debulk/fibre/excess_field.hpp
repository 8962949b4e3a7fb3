#pragma once

#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/fibre/fibre_lines.hpp"
#include "debulk/fibre/gaps_along.hpp"
#include "debulk/fibre/runs.hpp"
#include "debulk/pocket/polygon.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// The excess of all fibre lines over a ply (docs/model.md, section 9).
struct ExcessField {
  std::vector<FibreRun> runs;  // line by line, the first family first
  FlatNoise noise;             // of the flat ply beside what stands up
  Grid<float> largest;         // mm, per cell, the largest excess of a run over it, of either family; 0 where none is
  Grid<std::uint8_t> family;   // per cell, of that run; 0 where none is
};

// What is used again for the next scan of a ply on its mold: some MB, whose pages cost as much as the sums in them when
// they are new.
struct FibreMemory {
  std::vector<PointGaps> points;
  TileMemory tiles;  // of whole scans: a window's are elsewhere each time
};

// Reads the lines over the heights of the ply's upper side above the datum of its thickness (surface/datum.hpp), mm, NaN
// where nothing is known. `whole`: beyond them nothing is known; otherwise the ply lies flat there. `memory` is that
// of the scans before. The same input gives the same bits on any number of threads. Throws InputError and Stopped.
ExcessField measure_excess(const std::vector<FibreLine>& lines, const Grid<float>& heights, const Polygon& ply, const Surface& mold,
                           bool whole, const FibreOptions& options, FibreMemory& memory, const Stop& stop = Stop());
ExcessField measure_excess(const std::vector<FibreLine>& lines, const Grid<float>& heights, const Polygon& ply, const Surface& mold,
                           bool whole, const FibreOptions& options, const Stop& stop = Stop());

// A run, by its index, and a foot that it crosses, by its label.
struct FootCrossing {
  std::int32_t run, label;
};

// Returns all crossings of the runs with labelled cells, in the order of the runs.
std::vector<FootCrossing> foot_crossings(const std::vector<FibreLine>& lines, const std::vector<FibreRun>& runs,
                                         const Grid<std::int32_t>& labels);

}  // namespace debulk
