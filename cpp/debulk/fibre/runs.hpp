#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "debulk/fibre/fibre_lines.hpp"
#include "debulk/fibre/filter_loss.hpp"
#include "debulk/fibre/spans.hpp"

namespace debulk {

// What holds a run at an end: the ply that goes on along the line; nothing, since the ply's edge is nearer; or nobody
// knows, since cells that were not seen are nearer.
enum class FibreEnd : std::uint8_t { held, free, unknown };

// Spans of one line between which so little ply lies flat that one fold can draw all of it.
struct FibreRun {
  int family = 0;                 // 0: along the first fibre; 1: along the second
  int line = 0;                   // index of its line
  int first = 0, last = 0;        // points of the line, the first and the last off the mold
  int spans = 1;                  // number of its spans
  Eigen::Vector2d from, to, top;  // mold XY, mm: its first and last point off the mold, and that of the largest gap
  double gap = 0.0;               // mm, the largest
  double length = 0.0;            // mm, from its first to its last point
  double flat = 0.0;              // mm of ply that lies flat between its spans
  // mm, with the noise's share taken out, and without `uncertainty`. The low end is what is surely in one fold: the most
  // that spans without flat ply between them have together. The others are those of all spans.
  ExcessRange excess;
  double uncertainty = 0.0;        // mm, two standard deviations, by the scan's noise and of the reading
  double turn = 0.0;               // mm/rad, change of the excess as the fibre's direction turns
  std::array<FibreEnd, 2> ends{};  // at `from` and at `to`
  std::array<double, 2> beyond{};  // mm of ply beyond the ends, as far as it is known
};

// Blurs by which the heights of the two scales are smoothed, mm2, and the width of the narrowest bump that is judged.
struct ScaleBlurs {
  double fine = 0.0, coarse = 0.0, least = 0.0;
};

// Returns the runs of one line, given its spans and gaps in order: each span by itself, and for each span the longest
// sums that begin with it and exceed those of its parts.
void join_spans(const FibreLine& line, int index, const std::vector<FibreSpan>& spans, const std::vector<Stretch>& gaps,
                const FlatNoise& noise, const ScaleBlurs& blurs, const FibreOptions& options, std::vector<FibreRun>& out);

}  // namespace debulk
