#pragma once

#include <cstdint>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/grid.hpp"
#include "debulk/surface/fill_holes.hpp"
#include "debulk/surface/gridding.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {

struct HeightMapOptions {
  double spacing = 0.0;  // mm; 0: the scan's median pitch
  GriddingOptions gridding;
  FillOptions fill;

  void check() const;
};

struct HeightMap {
  Grid<float> heights;          // mm above the reference; NaN: not known
  Grid<std::uint8_t> measured;  // 1 where both were seen, 0 where the height is filled in or NaN
  // The heights before a median, if there was one: pockets are found in the median's heights, and measured on these,
  // whose blur is known.
  Grid<float> before_median;
};

// Height of a scan above a reference, both in the mold frame, compared at equal x and y. Both clouds are laid on one
// grid, so that the sideways shift of raised points in the camera's view (parallax) has no effect. The grid covers
// what the two boxes have in common. Outliers must have been removed (set to NaN) before, because a flying pixel would
// be a spike. Throws InputError and Stopped.
HeightMap height_map(const CloudView& scan, const CloudView& reference, const HeightMapOptions& options = {}, int threads = 0,
                     const Stop& stop = Stop());
// The same above a smooth reference, within its grid.
HeightMap height_map(const CloudView& scan, const Reference& reference, const HeightMapOptions& options = {}, int threads = 0,
                     const Stop& stop = Stop());

}  // namespace debulk
