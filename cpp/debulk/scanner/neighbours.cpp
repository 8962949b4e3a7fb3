#include "debulk/scanner/neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int least_support = 3, least_votes = 4;
constexpr float most_order_change = 2;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

struct Change {
  long at;
  float phase;
};

// The phase with the order that the sure neighbours ask for; NaN if they are too few or do not agree.
float repaired(const float* phase, long width, long at, float order_step) {
  const float own = -1.0f - phase[at];
  int votes = 0;
  float wanted = 0;
  for (long above = -width; above <= width; above += width)
    for (long beside = -1; beside <= 1; ++beside) {
      const float other = phase[at + above + beside];
      if (!(other >= 0)) continue;
      const float order = std::round((other - own) / order_step);
      if (votes++ > 0 && order != wanted) return nan;
      wanted = order;
    }
  return votes >= least_votes && std::abs(wanted) <= most_order_change ? own + wanted * order_step : nan;
}

// Whether a sure phase at a pixel with fewer than eight neighbours stays: at least two of them must support it.
bool supported_at_border(const float* phase, long width, long height, long row, long column, float order_step) {
  int support = 0;
  for (long j = std::max(row - 1, 0L); j <= std::min(row + 1, height - 1); ++j)
    for (long i = std::max(column - 1, 0L); i <= std::min(column + 1, width - 1); ++i) {
      const float other = phase[j * width + i];
      support += other >= 0 && std::abs(other - phase[row * width + column]) < 0.5f * order_step;
    }
  return support >= 3;  // the pixel itself is counted, too
}

#define DEBULK_KERNEL "debulk/scanner/neighbours_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

NeighbourCounts check_neighbours(float* phase_rad, int width, int height, double order_step, int threads, const Stop& stop, Isa isa) {
  // All changes are found before any is made, so that the order in which threads run does not matter.
  constexpr long strip = 16;
  const float step = static_cast<float>(order_step);
  std::vector<std::vector<Change>> found(static_cast<std::size_t>((height + strip - 1) / strip));
  parallel_for(height, strip, threads, stop, [&](long begin, long end) {
    std::vector<Change>& here = found[static_cast<std::size_t>(begin / strip)];
    for (long row = begin; row < end; ++row) {
      const bool border = row == 0 || row == height - 1 || width < 18;
      for (long i = 0; i < width; i += border ? 1 : width - 1) {
        const long at = row * width + i;
        if (phase_rad[at] < 0 || (phase_rad[at] >= 0 && !supported_at_border(phase_rad, width, height, row, i, step)))
          here.push_back({at, nan});
      }
      if (!border) DEBULK_ON(isa, run(phase_rad, width, row, step, here));
    }
  });
  NeighbourCounts counts;
  for (const std::vector<Change>& changes : found)
    for (const Change& change : changes) {
      if (change.phase == change.phase)
        ++counts.repaired;
      else if (phase_rad[change.at] >= 0)
        ++counts.isolated;
      phase_rad[change.at] = change.phase;
    }
  return counts;
}

}  // namespace debulk
