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
  double level = 2.0;                  // mm, of the outline
  double window_mm = 8.0;              // of the local quadratic fits (smooth.hpp)
  double blur_mm2 = 0.0;               // of the heights, undone by the fits
  std::optional<Polygon> ply_outline;  // checked, mold XY, mm; none: unknown
};

// Noise pushes the highest of many heights up, gridding and filters pull every crest down and every hollow up, and a scanner's pixels at
// the ply's edge see partly what lies beside it. So the pocket is looked at once more: heights averaged over squares of an eighth of the
// window, those next to the ply's edge left out, a quadratic fitted round each (where some are left out, from the side), the blur undone;
// outline, volume and peak are this surface's. Its contour is sought within half a window of the component's own; where the surface stands
// above the level further out, or where a neighbour is as near, the outline ends there.
//
// Of the components, those are pockets of which `pocket` is not 0; `component` is one of them. before_median: the heights before a median
// filter, of the same shape, if there are such; they are averaged, where they are known. None: the window is below three heights, or the
// surface does not reach the level.
std::optional<SmoothOutline> smooth_outline(const Components& components, std::size_t component, const std::vector<std::uint8_t>& pocket,
                                            const Grid<float>& heights, const Grid<float>* before_median,
                                            const SmoothOutlineOptions& options);

}  // namespace debulk
