#include "debulk/scanner/stereo.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/pool.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();

struct Work {
  RectifiedRow left, right;
  RowMatcher matcher;
  std::vector<float> disparity, sigma;
  std::vector<double> depth, across;  // mm; of each column, the part of its ray across the view, for a depth of 1
};

// Computes the points of a row from its disparities. Those outside the allowed depths become NaN.
DEBULK_WIDE void triangulate(const StereoGeometry& g, int row, int width, Work& work, const StereoMaps& maps, MatchCounts& counts) {
  const double v = (row - g.cy) / g.focal, shift = g.right_cx - g.left_cx, depth_px = g.focal * g.baseline;
  const double nearest = g.nearest, furthest = g.furthest;  // copies, which no store can change: then the loop takes several at once
  float *disparity = work.disparity.data(), *sigma = work.sigma.data();
  double *depth = work.depth.data(), *across = work.across.data();
  const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(width);
  int behind = 0;
  for (int i = 0; i < width; ++i) {
    const double d = disparity[i] + shift, z = depth_px / d;
    const bool fine = (d > 0) & (z >= nearest) & (z <= furthest);
    behind += (d == d) & !fine;
    disparity[i] = fine ? disparity[i] : nan, sigma[i] = fine ? sigma[i] : nan, depth[i] = fine ? z : nan;
  }
  counts.behind += behind, counts.matched -= behind;
  if (maps.points) {
    float* point = maps.points + 3 * first;
    for (int i = 0; i < width; ++i, point += 3) {
      const double z = depth[i];
      point[0] = static_cast<float>(z * across[i]), point[1] = static_cast<float>(z * v), point[2] = static_cast<float>(z);
    }
  }
  // dz / dd = -z² / (f b), and the distance along the ray is sqrt(1 + u² + v²) times the depth.
  if (maps.uncertainty) {
    const double per_px = 1 / depth_px, off = 1 + v * v;
    for (int i = 0; i < width; ++i)
      maps.uncertainty[first + static_cast<std::size_t>(i)] =
          static_cast<float>(sigma[i] * depth[i] * depth[i] * per_px) * std::sqrt(static_cast<float>(off + across[i] * across[i]));
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
    work->disparity.resize(width + row_room), work->sigma.resize(width + row_room);
    if (geometry && work->across.empty()) {
      work->depth.resize(width);
      for (std::size_t i = 0; i < width; ++i) work->across.push_back((static_cast<double>(i) - geometry->left_cx) / geometry->focal);
    }
    for (int row = static_cast<int>(begin); row < end; ++row) {
      rectify_row(left, row, work->left, options.isa), rectify_row(right, row, work->right, options.isa);
      MatchCounts counts = work->matcher.match(work->left, left.rectified_width, left_step, left.edge, work->right, right.rectified_width,
                                               right_step, right.edge, work->disparity.data(), work->sigma.data(), options.isa);
      if (geometry) triangulate(*geometry, row, left.rectified_width, *work, maps, counts);
      const std::size_t first = static_cast<std::size_t>(row) * width;
      if (maps.disparity) std::copy_n(work->disparity.begin(), width, maps.disparity + first);
      if (maps.sigma) std::copy_n(work->sigma.begin(), width, maps.sigma + first);
      parts[static_cast<std::size_t>(begin / strip)] += counts;
    }
  });
  MatchCounts all;
  for (const MatchCounts& part : parts) all += part;
  return all;
}

}  // namespace debulk
