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
  std::optional<double> flag_mm;      // an elevation of this height gets a region; without a value, half the cut height
  double largest_share = 0.5;         // share of the image in regions above which processing the whole scan is cheaper
  int row_step = 0, column_step = 0;  // of the coarse mesh, pixels, for studies; 0: the widest that the area tolerance allows

  void check() const;
};

// A part of the ply with pockets in it. Its heights are exact round every elevation; elsewhere they are those of the
// coarse pass.
struct Region {
  Window window;  // its place in the whole height map
  Segmentation segmentation;
  FootMap feet;
};

}  // namespace debulk
