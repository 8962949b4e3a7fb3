#pragma once

#include "debulk/pocket/region_front.hpp"

namespace debulk {

// What a thread needs for one window.
struct RegionFront::Scratch {
  CloudPart part;
  PinholeOutliers image;
  RayBase base;
  Grid<float> other;
  HoleFilling filling;
};

struct RegionFront::Work {
  Window window;
  HeightMap map;
  std::optional<Segmentation> segmentation;
  std::optional<FootMap> feet;
};

}  // namespace debulk
