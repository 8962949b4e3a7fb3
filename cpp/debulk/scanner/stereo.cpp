#include "debulk/scanner/stereo.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/pool.hpp"

namespace debulk {
namespace {

struct Work {
  RectifiedRow left, right;
  RowMatcher matcher;
  std::vector<float> disparity, sigma;
};

// Computes the points of a row from its disparities. Those outside the allowed depths become NaN.
void triangulate(const StereoGeometry& g, int row, Work& work, const StereoMaps& maps, MatchCounts& counts) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const std::size_t width = work.disparity.size(), first = static_cast<std::size_t>(row) * width;
  const double v = (row - g.cy) / g.focal, shift = g.right_cx - g.left_cx;
  for (std::size_t i = 0; i < width; ++i) {
    const double d = work.disparity[i] + shift, z = g.focal * g.baseline / d;
    const bool fine = d > 0 && z >= g.nearest && z <= g.furthest;
    if (d == d && !fine) ++counts.behind, --counts.matched, work.disparity[i] = work.sigma[i] = nan;
    const double u = (static_cast<double>(i) - g.left_cx) / g.focal;
    if (maps.points) {
      float* point = maps.points + 3 * (first + i);
      point[0] = fine ? static_cast<float>(z * u) : nan;
      point[1] = fine ? static_cast<float>(z * v) : nan;
      point[2] = fine ? static_cast<float>(z) : nan;
    }
    // dz / dd = -z² / (f b), and the distance along the ray is sqrt(1 + u² + v²) times the depth.
    if (maps.uncertainty)
      maps.uncertainty[first + i] =
          fine ? static_cast<float>(work.sigma[i] * z * z / (g.focal * g.baseline) * std::sqrt(1 + u * u + v * v)) : nan;
  }
}

}  // namespace

MatchCounts match_rows(PhaseView left, PhaseView right, const StereoGeometry* geometry, const StereoOptions& options,
                       const StereoMaps& maps, const Stop& stop) {
  require(left.rectified_height == right.rectified_height, "right", "as many rectified rows as the left image has", right.rectified_height);
  require(options.edge_ratio >= 1, "edge_ratio", "1 or more", options.edge_ratio);
  const float left_step = median_step(left), right_step = median_step(right);
  left.edge = static_cast<float>(options.edge_ratio * left_step), right.edge = static_cast<float>(options.edge_ratio * right_step);

  constexpr long strip = 8;
  const int rows = left.rectified_height;
  const std::size_t width = static_cast<std::size_t>(left.rectified_width);
  std::vector<MatchCounts> parts(static_cast<std::size_t>((rows + strip - 1) / strip));
  Pool<Work> pool;
  parallel_for(rows, strip, options.threads, stop, [&](long begin, long end) {
    const auto work = pool.borrow();
    work->disparity.resize(width), work->sigma.resize(width);
    for (int row = static_cast<int>(begin); row < end; ++row) {
      rectify_row(left, row, work->left, options.isa), rectify_row(right, row, work->right, options.isa);
      MatchCounts counts = work->matcher.match(work->left, left.rectified_width, left_step, left.edge, work->right, right.rectified_width,
                                               right_step, right.edge, work->disparity.data(), work->sigma.data());
      if (geometry) triangulate(*geometry, row, *work, maps, counts);
      const std::size_t first = static_cast<std::size_t>(row) * width;
      if (maps.disparity) std::copy(work->disparity.begin(), work->disparity.end(), maps.disparity + first);
      if (maps.sigma) std::copy(work->sigma.begin(), work->sigma.end(), maps.sigma + first);
      parts[static_cast<std::size_t>(begin / strip)] += counts;
    }
  });
  MatchCounts all;
  for (const MatchCounts& part : parts) all += part;
  return all;
}

}  // namespace debulk
