#pragma once

#include <optional>

#include "debulk/pocket/foot_contours.hpp"
#include "debulk/pocket/segment.hpp"
#include "debulk/region/windows.hpp"
#include "debulk/surface/front_end.hpp"

namespace debulk {

struct RegionOptions {
  FrontEndOptions front;
  SegmentOptions segment;
  FootOptions feet;
  std::optional<double> flag_mm;      // what stands as high gets a region; none: half the cut
  double largest_share = 0.8;         // of the image in regions: above it, the whole scan is cheaper
  int row_step = 0, column_step = 0;  // of the coarse mesh, pixels, for studies; 0: the widest that the area tolerance allows

  void check() const;
};

// A part of the ply with pockets in it. Its heights are exact round everything that stands up, and the coarse pass's
// elsewhere.
struct Region {
  Window window;  // of the whole height map
  Segmentation segmentation;
  FootMap feet;
};

}  // namespace debulk
