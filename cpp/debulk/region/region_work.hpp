#pragma once

#include "debulk/region/region_front.hpp"

namespace debulk {

// The buffers that a thread needs to process one window.
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
  std::vector<Window> exact;      // rectangles in which the heights are exact
  std::vector<Window> to_make;    // the part of them that no earlier window had
  Grid<float> unfiltered;         // heights before filtering, for a larger window to take over
  bool done = false;              // true: the window is segmented and its feet are found
  std::vector<Window> to_refine;  // blocks whose heights are not exact but should be

  const Window& window() const { return region->window; }
};

}  // namespace debulk
