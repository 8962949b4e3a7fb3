#pragma once

#include <optional>

#include "debulk/cloud/cloud_view.hpp"

namespace debulk {

// A pinhole camera at the origin of the cloud's frame: pixel (column i, row j) looks along ((i - cx) / f, (j - cy) / f, 1).
struct Pinhole {
  double f = 0, cx = 0, cy = 0;  // pixels

  void check() const;
  double u(double column) const { return (column - cx) / f; }
  double v(double row) const { return (row - cy) / f; }
};

constexpr double pinhole_tolerance = 0.1;  // pixels by which a point's image may lie off its pixel

// The largest distance, along the image's rows or columns, of a point's image from its pixel, over every `stride`-th
// row and column. Infinite if a point is not in front of the camera.
double pinhole_error(const CloudView& cloud, const Pinhole& camera, int stride = 1, int threads = 0);

// The camera that best fits an organised cloud in the scanner's frame (least squares of the pixel distances), from an
// even sample. Empty if the cloud is unorganised, if a sampled point lies farther than pinhole_tolerance off its
// pixel, or if there are too few points to fit to.
std::optional<Pinhole> fit_pinhole(const CloudView& cloud);

}  // namespace debulk
