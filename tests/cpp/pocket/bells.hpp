#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/grid.hpp"

namespace debulk {

inline const double kPi = std::acos(-1.0);
inline const float kUnknown = std::numeric_limits<float>::quiet_NaN();

// H cos^2(pi rho / 2) for rho < 1, rho the distance from the centre in an ellipse with half axes a, b turned by `angle`.
struct Bell {
  Eigen::Vector2d centre;
  double height, a, b;
  double angle = 0;

  double at(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d d = p - centre;
    const double u = (std::cos(angle) * d.x() + std::sin(angle) * d.y()) / a, v = (-std::sin(angle) * d.x() + std::cos(angle) * d.y()) / b;
    const double rho = std::hypot(u, v);
    return rho < 1 ? height * std::pow(std::cos(kPi * rho / 2), 2) : 0.0;
  }
  // rho at which the bell stands `level` above its base.
  double rho(double level) const { return 2 / kPi * std::acos(std::sqrt(level / height)); }
  double area(double level) const { return kPi * a * b * rho(level) * rho(level); }
  // Integral of the bell over the inside of that contour: 2 pi a b H int rho cos^2(pi rho / 2) drho.
  double volume(double level) const {
    const double r = rho(level);
    return kPi * a * b * height * (r * r / 2 + r * std::sin(kPi * r) / kPi + (std::cos(kPi * r) - 1) / (kPi * kPi));
  }
};

// base + the higher of the bells, at every point of a grid whose corner lies at (x0, y0).
inline Grid<float> sampled_bells(const std::vector<Bell>& bells, int nx, int ny, double spacing, double base = 0, double x0 = 0,
                                 double y0 = 0) {
  Grid<float> heights(nx, ny, {x0, y0}, spacing);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      double h = 0;
      for (const Bell& bell : bells) h = std::max(h, bell.at(heights.position(i, j)));
      heights.at(i, j) = static_cast<float>(base + h);
    }
  return heights;
}

inline void drop_disc(Grid<float>& heights, const Eigen::Vector2d& centre, double radius) {
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i)
      if ((heights.position(i, j) - centre).norm() < radius) heights.at(i, j) = kUnknown;
}

// Repeatable noise of standard deviation 1 that is the same everywhere: splitmix64 and the sum of 12 uniforms.
inline double noise(unsigned long index) {
  double sum = -6;
  for (unsigned long k = 0; k < 12; ++k) {
    unsigned long z = (index * 12 + k + 1) * 0x9E3779B97F4A7C15UL;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9UL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBUL;
    sum += static_cast<double>((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
  }
  return sum;
}

}  // namespace debulk
