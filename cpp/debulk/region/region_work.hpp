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
  bool done = false;              // segmented, with feet
  std::vector<Window> to_refine;  // blocks that are not exact and should be

  const Window& window() const { return region->window; }
};

}  // namespace debulk
