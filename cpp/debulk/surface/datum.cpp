#include "debulk/surface/datum.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr double kFlat = 1e-3, kSettled = 1e-7;  // mm
constexpr int kRounds = 60;                      // each brings the foot nearer by the thickness over the mold's radius

// How far the datum lies above the mold at a place. The foot is where the normal starts that ends over the place.
double raised(const Reference& mold, const Eigen::Vector2d& xy, double thickness) {
  const double below = mold.height(xy);
  Eigen::Vector2d foot = xy;
  SurfaceSample at = mold.sample(foot);
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::Vector2d next = xy + thickness / std::sqrt(1 + at.gradient.squaredNorm()) * at.gradient;
    const double moved = (next - foot).norm();
    foot = next;
    at = mold.sample(foot);
    if (moved < kSettled) break;
  }
  return at.height - below + thickness * (1 / std::sqrt(1 + at.gradient.squaredNorm()) - 1);
}

}  // namespace

Reference datum(const Reference& mold, double thickness, int threads) {
  require(std::isfinite(thickness) && thickness >= 0, "thickness_mm", "a length in mm, not negative", thickness);
  Grid<double> heights = mold.heights();
  std::vector<double> most(static_cast<std::size_t>(heights.ny), 0.0);
  parallel_for(heights.ny, 16, threads, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < heights.nx; ++i) {
        const double up = raised(mold, heights.position(i, j), thickness);
        heights.at(i, j) += up;
        most[static_cast<std::size_t>(j)] = std::max(most[static_cast<std::size_t>(j)], std::abs(up));
      }
  });
  return *std::max_element(most.begin(), most.end()) < kFlat ? mold : Reference(std::move(heights));
}

}  // namespace debulk
