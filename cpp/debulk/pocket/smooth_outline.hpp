#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/pocket/components.hpp"
#include "debulk/pocket/outline.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// A pocket measured on a smooth surface through its heights.
struct SmoothOutline {
  Outline outline;
  double peak = 0;
  Eigen::Vector2d peak_position = Eigen::Vector2d::Zero();
};

struct SmoothOutlineOptions {
  double level = 2.0;                  // height of the outline, mm
  double window_mm = 8.0;              // of the local quadratic fits (smooth.hpp)
  double blur_mm2 = 0.0;               // of the heights, undone by the fits
  std::optional<Polygon> ply_outline;  // checked, mold XY, mm; empty: unknown
};

// Noise raises the highest of many heights, gridding and filters lower every crest and raise every hollow, and a
// scanner's pixels at the ply's edge partly see what lies beside it. The pocket is therefore measured once more.
// Heights are averaged over squares of an eighth of the window, those next to the ply's edge are left out, a quadratic
// is fitted round each (from the side, where some are left out), and the blur is undone. Outline, volume and peak are
// those of this surface. Its contour is sought within half a window of the component's own. Where the surface is above
// the level further out, or where a neighbour is as near, the outline ends there.
//
// Those components are pockets whose entry in `pocket` is not 0; `component` is one of them. before_median: the
// heights before a median filter, of the same shape, if there are such; they are averaged where they are known. The
// result is empty if the window is below three heights, if the surface does not reach the level, or if it has an
// unknown height within its outline.
std::optional<SmoothOutline> smooth_outline(const Components& components, std::size_t component, const std::vector<std::uint8_t>& pocket,
                                            const Grid<float>& heights, const Grid<float>* before_median,
                                            const SmoothOutlineOptions& options);

}  // namespace debulk
