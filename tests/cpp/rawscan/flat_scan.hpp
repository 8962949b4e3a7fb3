#pragma once

#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "debulk/rawscan/standing_wrinkles.hpp"
#include "surface/looking_down.hpp"

// Scans of what stands on the plane z = 0, and the finder of what is too narrow for the filters.
namespace debulk::flat_scan {

constexpr int kWidth = 480, kHeight = 360;
constexpr double kPitch = 0.5;

using Shape = std::function<double(double x, double y)>;

// Of what stands up, by so much along each pixel's ray.
inline std::vector<float> scan_of(const Shape& height, double noise = 0.0) {
  const View view = looking_down(kWidth, kHeight);
  std::mt19937 random(3);
  std::normal_distribution<double> off(0.0, 1.0);
  std::vector<float> points;
  for (int j = 0; j < kHeight; ++j)
    for (int i = 0; i < kWidth; ++i) {
      const double u = view.camera.u(i), v = view.camera.v(j);
      const double depth = 500 - height(500 * u, -500 * v) + noise * off(random);
      for (const double c : {u * depth, v * depth, depth}) points.push_back(static_cast<float>(c));
    }
  return points;
}

inline WrinkleFinder finder(const Polygon& ply = {}) {
  const Grid<double> flat(61, 49, {-120, -96}, 4.0, 0.0);
  Grid<float> seen(481, 385, {-120, -96}, 0.5, 0.0f);
  return WrinkleFinder(std::make_shared<Reference>(flat), seen, looking_down(kWidth, kHeight).mold_from_scanner, ply, 2);
}

inline CloudView view_of(const std::vector<float>& points) {
  return {points.data(), kWidth, kHeight};
}

}  // namespace debulk::flat_scan
