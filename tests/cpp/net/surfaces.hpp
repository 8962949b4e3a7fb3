#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "debulk/surface/surface.hpp"

// Exact surfaces for tests.
namespace debulk::exact {

struct Plane : Surface {
  double z0 = 0;
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  explicit Plane(double height = 0, const Eigen::Vector2d& gradient = {0, 0}) : z0(height), slope(gradient) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override { return {z0 + slope.dot(p), slope, Eigen::Matrix2d::Zero()}; }
};

// Upper half of a sphere about the origin; NaN beyond its equator.
struct Sphere : Surface {
  double radius;
  explicit Sphere(double r) : radius(r) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    const double z = std::sqrt(radius * radius - p.squaredNorm());
    return {z, -p / z, -Eigen::Matrix2d::Identity() / z - p * p.transpose() / (z * z * z)};
  }
};

// Upper half of a cylinder about the x axis.
struct Cylinder : Surface {
  double radius;
  explicit Cylinder(double r) : radius(r) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    const double z = std::sqrt(radius * radius - p.y() * p.y());
    SurfaceSample s{z, {0, -p.y() / z}, Eigen::Matrix2d::Zero()};
    s.hessian(1, 1) = -radius * radius / (z * z * z);
    return s;
  }
};

// Rolling hills: amplitude * sin(k x + 0.3) cos(0.7 k y) + slope . p.
struct Hills : Surface {
  double amplitude, k;
  Eigen::Vector2d slope;
  Hills(double a, double wave_number, const Eigen::Vector2d& gradient) : amplitude(a), k(wave_number), slope(gradient) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    const double l = 0.7 * k, u = k * p.x() + 0.3, v = l * p.y();
    SurfaceSample s;
    s.height = amplitude * std::sin(u) * std::cos(v) + slope.dot(p);
    s.gradient = amplitude * Eigen::Vector2d(k * std::cos(u) * std::cos(v), -l * std::sin(u) * std::sin(v)) + slope;
    const double xy = -amplitude * k * l * std::cos(u) * std::sin(v);
    s.hessian << -amplitude * k * k * std::sin(u) * std::cos(v), xy, xy, -amplitude * l * l * std::sin(u) * std::cos(v);
    return s;
  }
};

// A cos^2 bell on the plane z = 0: peak * cos^2(pi r / 2 R) within R of its centre, elliptic by a stretch along x.
struct Bell : Surface {
  double peak, radius, stretch;
  Eigen::Vector2d centre;
  Bell(double h, double r, double along_x = 1, const Eigen::Vector2d& c = {0, 0}) : peak(h), radius(r), stretch(along_x), centre(c) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    const double pi = std::acos(-1.0);
    const Eigen::Vector2d q((p.x() - centre.x()) / stretch, p.y() - centre.y());
    const double r = q.norm();
    SurfaceSample s;
    if (r >= radius) return s;
    const double w = pi / radius;
    s.height = peak * 0.5 * (1 + std::cos(w * r));
    const Eigen::Vector2d shrink(1 / stretch, 1);
    const double over_r = r > 1e-9 ? -peak * 0.5 * w * std::sin(w * r) / r : -peak * 0.5 * w * w;  // f'(r) / r
    s.gradient = over_r * q.cwiseProduct(shrink);
    const double second = -peak * 0.5 * w * w * std::cos(w * r);
    Eigen::Matrix2d h = over_r * Eigen::Matrix2d::Identity();
    if (r > 1e-9) h += (second - over_r) * q * q.transpose() / (r * r);
    s.hessian = shrink.asDiagonal() * h * shrink.asDiagonal();
    return s;
  }
};

// Another surface turned about the z axis, counter-clockwise.
struct Turned : Surface {
  const Surface& other;
  Eigen::Matrix2d turn;
  Turned(const Surface& surface, double angle) : other(surface), turn(Eigen::Rotation2Dd(angle).toRotationMatrix()) {}
  SurfaceSample sample(const Eigen::Vector2d& p) const override {
    const SurfaceSample s = other.sample(turn.transpose() * p);
    return {s.height, turn * s.gradient, turn * s.hessian * turn.transpose()};
  }
};

}  // namespace debulk::exact
