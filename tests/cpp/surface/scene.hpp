#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "debulk/cloud/cloud_view.hpp"

// What a tilted pinhole camera 2.4 m above the mold sees of a surface z = F(x, y), exactly, in the mold frame.
namespace debulk::testing {

constexpr float nanf = std::numeric_limits<float>::quiet_NaN();

class Noise {
 public:
  explicit Noise(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15u + 1) {}
  double uniform() {  // splitmix64
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * M_PI * uniform());
  }

 private:
  std::uint64_t state_;
};

using Height = std::function<double(double, double)>;

struct Scan {
  int width, height;
  std::vector<float> xyz;
  CloudView view() const { return {xyz.data(), width, height}; }
  CloudView flat() const { return {xyz.data(), width * height, 1}; }
};

// pitch: mm between pixels on the mold, at its middle. sigma: mm, noise along the ray.
inline Scan scan(const Height& f, int width, int height, double pitch, double sigma, std::uint64_t seed) {
  Noise noise(seed);
  const double tilt = 0.22, distance = 2400;
  Eigen::Matrix3d axes;  // columns: the camera's right, down and forward
  axes << 1, 0, 0, 0, -std::cos(tilt), std::sin(tilt), 0, -std::sin(tilt), -std::cos(tilt);
  const Eigen::Vector3d eye = -distance * axes.col(2);
  Scan out{width, height, std::vector<float>(3 * static_cast<std::size_t>(width) * height)};
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const Eigen::Vector3d ray =
          (axes * Eigen::Vector3d((column - (width - 1) / 2.0) * pitch, (row - (height - 1) / 2.0) * pitch, distance)).normalized();
      double along = -eye.z() / ray.z();
      for (int k = 0; k < 60; ++k) {  // z falls by |ray.z| a mm: a contraction for slopes below 1
        const Eigen::Vector3d p = eye + along * ray;
        along -= (p.z() - f(p.x(), p.y())) / ray.z();
      }
      const Eigen::Vector3d p = eye + (along + sigma * noise.normal()) * ray;
      for (int a = 0; a < 3; ++a)
        out.xyz[3 * (static_cast<std::size_t>(row) * width + column) + static_cast<std::size_t>(a)] = static_cast<float>(p[a]);
    }
  return out;
}

inline double mold(double x, double y) {
  return x * x / 4000 - y * y / 6000 + 0.02 * x;
}
// cos² bell
inline double bell(double x, double y, double peak, double wide) {
  const double r = std::hypot(x, y);
  return r < wide / 2 ? peak * std::pow(std::cos(M_PI * r / wide), 2) : 0.0;
}

}  // namespace debulk::testing
