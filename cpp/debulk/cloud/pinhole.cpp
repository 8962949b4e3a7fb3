#include "debulk/cloud/pinhole.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {

void Pinhole::check() const {
  require(std::isfinite(f) && f > 0, "camera", "a positive focal length in pixels", f);
  require(std::isfinite(cx) && std::isfinite(cy), "camera", "a finite principal point in pixels", cx);
}

double pinhole_error(const CloudView& cloud, const Pinhole& camera, int stride, int threads) {
  camera.check();
  std::vector<double> worst(static_cast<std::size_t>(cloud.height), 0.0);
  parallel_for((cloud.height + stride - 1) / stride, 16, threads, [&](long begin, long end) {
    for (long k = begin; k < end; ++k) {
      const int row = static_cast<int>(k) * stride;
      double& most = worst[static_cast<std::size_t>(row)];
      for (int column = 0; column < cloud.width; column += stride) {
        const float* p = cloud.point(column, row);
        if (!std::isfinite(p[0] + p[1] + p[2])) continue;
        if (!(p[2] > 0)) {
          most = std::numeric_limits<double>::infinity();
          continue;
        }
        const double scale = camera.f / p[2];
        most = std::max({most, std::abs(p[0] * scale + camera.cx - column), std::abs(p[1] * scale + camera.cy - row)});
      }
    }
  });
  return worst.empty() ? 0.0 : *std::max_element(worst.begin(), worst.end());
}

std::optional<Pinhole> fit_pinhole(const CloudView& cloud) {
  if (!cloud.organised()) return std::nullopt;
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(cloud.size()) / 1e5)));
  // column = f X + cx, row = f Y + cy with X = x / z, Y = y / z: least squares over both at once.
  double n = 0, sx = 0, sy = 0, si = 0, sj = 0, squares = 0, products = 0;
  for (int row = 0; row < cloud.height; row += stride)
    for (int column = 0; column < cloud.width; column += stride) {
      const float* p = cloud.point(column, row);
      if (!std::isfinite(p[0] + p[1] + p[2])) continue;
      if (!(p[2] > 0)) return std::nullopt;
      const double x = static_cast<double>(p[0]) / p[2], y = static_cast<double>(p[1]) / p[2];
      n += 1, sx += x, sy += y, si += column, sj += row;
      squares += x * x + y * y;
      products += x * column + y * row;
    }
  if (n < 100) return std::nullopt;
  const double denominator = squares - (sx * sx + sy * sy) / n;
  if (!(denominator > 1e-12 * squares)) return std::nullopt;
  Pinhole camera;
  camera.f = (products - (sx * si + sy * sj) / n) / denominator;
  if (!(camera.f > 0)) return std::nullopt;
  camera.cx = (si - camera.f * sx) / n;
  camera.cy = (sj - camera.f * sy) / n;
  if (!(pinhole_error(cloud, camera, stride) <= pinhole_tolerance)) return std::nullopt;
  return camera;
}

}  // namespace debulk
