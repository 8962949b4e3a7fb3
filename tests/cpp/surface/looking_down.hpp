#pragma once

#include "debulk/surface/image_gridding.hpp"

namespace debulk {

// A camera 500 mm above the plane z = 0, looking down; 0.5 mm a pixel.
inline View looking_down(int width, int height) {
  View view;
  view.camera = {1000, (width - 1) / 2.0, (height - 1) / 2.0};
  view.width = width, view.height = height;
  view.mold_from_scanner.topLeftCorner<3, 3>() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  view.mold_from_scanner(2, 3) = 500;
  return view;
}

}  // namespace debulk
