#include "debulk/surface/image_gridding.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr int stretch_nodes = 16;
constexpr double base_mm = 4.0;  // between the rays at which the reference is met; F hardly bends in between

struct ImageTables {
  const float *x, *y, *z;
  int nx, across;
  float f, cx, cy, up[3];  // up: the mold's z in the scanner's frame
  const float *heights, *tiles;
  int width, height, tile_pitch;
};

#define DEBULK_KERNEL "debulk/surface/image_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

void grid_row(Isa isa, const ImageTables& tables, int row, float* out) {
  return DEBULK_ON(isa, run(tables, row, out));
}

}  // namespace

RayBase ray_base(const Reference& reference, const View& view, int threads) {
  view.camera.check();
  const Eigen::Vector3d o = view.centre();
  const Eigen::Matrix3d r = view.rotation();
  const auto ray = [&](double column, double row) -> Eigen::Vector3d {
    return r * Eigen::Vector3d(view.camera.u(column), view.camera.v(row), 1);
  };
  const auto depth_of = [&](const Eigen::Vector3d& d, double z) { return (z - o.z()) / d.z(); };
  const Grid<double>& f = reference.heights();
  const double middle = reference.height(f.position(f.nx / 2.0, f.ny / 2.0));
  // Rays up to a step beyond the reference are kept: the outermost pixels of its image lie between such a ray and the
  // last one within.
  const auto near = [&](const Eigen::Vector2d& xy, double step_mm) {
    const Eigen::Vector2d slack = Eigen::Vector2d::Constant(2 * step_mm), last = f.position(f.nx - 1, f.ny - 1);
    return (xy.array() >= (f.origin - slack).array()).all() && (xy.array() <= (last + slack).array()).all();
  };

  RayBase base;
  const double pitch = std::abs(depth_of(ray(view.width / 2.0, view.height / 2.0), middle)) / view.camera.f;
  for (base.step = 1; base.step < 16 && 2 * base.step * pitch <= base_mm;) base.step *= 2;
  base.nx = (view.width - 1) / base.step + 2, base.ny = (view.height - 1) / base.step + 2;
  base.depth.assign(static_cast<std::size_t>(base.nx) * static_cast<std::size_t>(base.ny), nan);
  base.gain = base.depth;
  parallel_for(base.ny, 8, threads, [&](long begin, long end) {
    for (long j = begin; j < end; ++j)
      for (int i = 0; i < base.nx; ++i) {
        const Eigen::Vector3d d = ray(static_cast<double>(i) * base.step, static_cast<double>(j) * base.step);
        double z = depth_of(d, middle), gain = nan, sag = 0;
        bool met = false;
        for (int round = 0; round < 20 && !met; ++round) {  // Newton's method on the clearance
          const SurfaceSample s = reference.sample((o + z * d).head<2>());
          gain = d.z() - s.gradient.dot(d.head<2>());
          sag = std::pow(base.step * pitch, 2) / 12 * s.hessian.trace();
          const double step = (o.z() + z * d.z() - s.height) / gain;
          z -= step;
          met = std::abs(step) < 1e-6;
        }
        if (!met || !(z > 0) || !near((o + z * d).head<2>(), base.step * pitch)) continue;
        const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(base.nx) + static_cast<std::size_t>(i);
        // Straight lines between the rays lie below a crest by the sag on average.
        base.depth[at] = static_cast<float>(z - sag / gain);
        base.gain[at] = static_cast<float>(gain);
      }
  });
  return base;
}

ImageGridding::ImageGridding(const Reference& reference, const View& view, const Grid<float>& grid, int threads)
    : view_(view), across_((grid.nx - 1) / stretch_nodes + 2) {
  const std::size_t size = static_cast<std::size_t>(across_) * static_cast<std::size_t>(grid.ny);
  point_x_.resize(size), point_y_.resize(size), point_z_.resize(size);
  const Eigen::Matrix3d to_scanner = view.rotation().transpose();
  const Eigen::Vector2d middle = grid.position(grid.nx / 2.0, grid.ny / 2.0);
  const double depth = to_scanner.row(2).dot(Eigen::Vector3d(middle.x(), middle.y(), reference.height(middle)) - view.centre());
  blur_mm2_ = std::pow(depth / view.camera.f, 2) / 4;
  parallel_for(grid.ny, 16, threads, [&](long begin, long end) {
    for (long j = begin; j < end; ++j)
      for (int i = 0; i < across_; ++i) {
        const Eigen::Vector2d xy = grid.position(static_cast<double>(i) * stretch_nodes, static_cast<double>(j));
        const Eigen::Vector3d p = to_scanner * (Eigen::Vector3d(xy.x(), xy.y(), reference.height(xy)) - view.centre());
        const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(across_) + static_cast<std::size_t>(i);
        point_x_[at] = static_cast<float>(p.x()), point_y_[at] = static_cast<float>(p.y()), point_z_[at] = static_cast<float>(p.z());
      }
  });
}

void ImageGridding::run(const PinholeOutliers& image, Grid<float>& grid, Isa isa, int threads, const Stop& stop) const {
  const Eigen::Vector3f up = view_.rotation().row(2).transpose().cast<float>();
  const ImageTables tables{point_x_.data(),
                           point_y_.data(),
                           point_z_.data(),
                           grid.nx,
                           across_,
                           static_cast<float>(view_.camera.f),
                           static_cast<float>(view_.camera.cx),
                           static_cast<float>(view_.camera.cy),
                           {up.x(), up.y(), up.z()},
                           image.heights().data(),
                           image.tiles().mean_height.data(),
                           view_.width,
                           view_.height,
                           image.tiles().pitch};
  parallel_for(grid.ny, 32, threads, stop, [&](long begin, long end) {
    for (long j = begin; j < end; ++j) grid_row(isa, tables, static_cast<int>(j), &grid.values[grid.index(0, static_cast<int>(j))]);
  });
}

}  // namespace debulk
