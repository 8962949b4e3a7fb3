#include "debulk/scanner/rectified_row.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "debulk/core/median.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float nearly_whole = 1.0f / 1024;  // a place nearer to a pixel than this is on it; the next one is not needed

// Whether pixel i of row j is a gap of one pixel: two pixels on each side lie on one surface, on which the phase goes on
// at the same rate, and the pixel itself does not lie there. A bend of a usual step, a third of the edge, can be noise;
// more is a step of the surface. Along edges of objects, pixels without a phase stand one above the other. So a pixel
// without a phase is such a gap only if those above and below it lie on the surface.
bool alone(const PhaseView& view, int j, int i) {
  if (i < 2 || i + 2 >= view.width) return false;
  const float* row = view.phase + static_cast<std::ptrdiff_t>(j) * view.width;
  if (std::abs(row[i] - row[i - 1]) <= view.edge || std::abs(row[i + 1] - row[i]) <= view.edge) return false;
  const float across = row[i + 1] - row[i - 1], before = row[i - 1] - row[i - 2], after = row[i + 2] - row[i + 1];
  if (!(std::abs(across) <= view.edge && std::abs(across - before - after) <= view.edge / 3)) return false;
  if (row[i] == row[i]) return true;
  const float middle = 0.5f * (row[i - 1] + row[i + 1]);
  return j > 0 && j + 1 < view.height && std::abs(row[i - view.width] - middle) <= view.edge &&
         std::abs(row[i + view.width] - middle) <= view.edge;
}

// A place in a row of the image as it was taken: the fraction t of the way between two of its pixels.
struct Place {
  int from = 0, to = 0;
  float t = 0;
  float at(const float* row) const { return row[from] + t * (row[to] - row[from]); }
};

// The place u to the right of pixel i of row j. If one of the two pixels round it is a gap, it lies between those beside
// this.
Place place_in(const PhaseView& view, int j, int i, float u) {
  const float* row = view.phase + static_cast<std::ptrdiff_t>(j) * view.width;
  const int next = u > 0 ? i + 1 : i;
  if (next != i && std::abs(row[next] - row[i]) <= view.edge) return {i, next, u};
  const bool first = alone(view, j, i), second = next != i && alone(view, j, next);
  if (next == i && !first) return {i, i, 0};
  if (first == second) return {i, next, nan};
  return first ? Place{i - 1, i + 1, 0.5f * (1 + u)} : Place{i, i + 2, 0.5f * u};
}

// Interpolates a pixel of the rectified row at which the four pixels round it are not on one surface: the place is u to
// the right of pixel i and v below row j.
void bridge(const PhaseView& view, int i, int j, float u, float v, int column, RectifiedRow& out) {
  const auto row_at = [&](const float* map, int row) { return map + static_cast<std::ptrdiff_t>(row) * view.width; };
  const int next = v > 0 ? j + 1 : j;
  const Place above = place_in(view, j, i, u), below = place_in(view, next, i, u);
  if (above.to - above.from < 2 && below.to - below.from < 2) return;
  const float high = above.at(row_at(view.phase, j)), low = below.at(row_at(view.phase, next));
  if (!(std::abs(low - high) <= view.edge)) return;
  const std::size_t at = static_cast<std::size_t>(column);
  out.phase[at] = high + v * (low - high);
  const Place& nearest = v <= 0.5f ? above : below;
  const bool measured = i + (u > 0.5f) == (nearest.t > 0.5f ? nearest.to : nearest.from);
  if (!measured) out.bridged.push_back(column);
  out.fraction[at] = nearest.t;
  if (view.noise) out.noise[at] = row_at(view.noise, v <= 0.5f ? j : j + 1)[nearest.from] * std::sqrt((1 - v) * (1 - v) + v * v);
}

#define DEBULK_KERNEL "debulk/scanner/rectified_row_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

void rectify_row(const PhaseView& view, int row, RectifiedRow& out, Isa isa) {
  const std::size_t width = static_cast<std::size_t>(view.rectified_width), room = width + row_room;
  out.phase.resize(room), out.noise.resize(room), out.fraction.resize(room), out.bridged.clear();
  if (view.map_x) {
    DEBULK_ON(isa, run(view, row, out));
    std::fill_n(out.phase.begin() + view.rectified_width, row_room, nan);
    return;
  }
  std::fill_n(out.phase.begin() + view.rectified_width, row_room, nan);
  const std::size_t first = static_cast<std::size_t>(row) * width;
  std::copy_n(view.phase + first, width, out.phase.begin());
  if (view.noise)
    std::copy_n(view.noise + first, width, out.noise.begin());
  else
    std::fill(out.noise.begin(), out.noise.end(), 0.0f);
  std::fill(out.fraction.begin(), out.fraction.end(), 0.0f);
  const float* taken = view.phase + first;
  for (int i = 1; i + 1 < view.width; ++i)
    if (!(std::abs(taken[i] - taken[i - 1]) <= view.edge)) bridge(view, i, row, 0, 0, i, out);
}

float median_step(const PhaseView& view) {
  std::vector<float> steps;
  for (int row = view.height / 64; row < view.height; row += std::max(1, view.height / 32)) {
    const float* phase = view.phase + static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width);
    for (int i = 0; i + 1 < view.width; ++i) {
      const float step = phase[i + 1] - phase[i];
      if (step == step) steps.push_back(std::abs(step));
    }
  }
  return upper_median(steps);
}

}  // namespace debulk
