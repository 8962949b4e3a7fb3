#pragma once

#include "debulk/region/region_front.hpp"

namespace debulk {

// What a thread needs for one window.
struct RegionFront::Scratch {
  CloudPart part;
  PinholeOutliers image;
  RayBase base;
  Grid<float> other;
  HoleFilling filling;
  Segmenter segmenter;
};

struct RegionFront::Work {
  HeightMap map;
  std::shared_ptr<Region> region = std::make_shared<Region>();
  std::vector<Window> exact;      // rectangles in which the heights are
  std::vector<Window> to_make;    // those of them that no earlier window had
  Grid<float> unfiltered;         // heights, for a larger window to take over
  bool done = false;              // segmented, with feet
  std::vector<Window> to_refine;  // blocks that are not exact and should be

  const Window& window() const { return region->window; }
};

}  // namespace debulk
