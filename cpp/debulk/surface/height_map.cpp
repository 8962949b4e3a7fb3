#include "debulk/surface/height_map.hpp"

#include <cmath>

#include "debulk/cloud/pitch.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/surface/sparse.hpp"

namespace debulk {
namespace {

// The scan's heights on a grid over the part of its box that lies within [low, high].
Grid<float> grid_scan(const CloudView& scan, const Eigen::Vector2d& low, const Eigen::Vector2d& high, const HeightMapOptions& options,
                      int threads, const Stop& stop) {
  const CloudBounds box = bounds(scan, threads);
  require(box.seen > 0, "scan", "a cloud with points that were seen", "none");
  const double spacing = options.spacing > 0 ? options.spacing : median_pitch(scan, threads, stop);
  require(spacing > 0, "scan", "a cloud with neighbouring points", "none that are neighbours");
  Grid<float> grid = covering_grid(box.low.head<2>().cwiseMax(low), box.high.head<2>().cwiseMin(high), spacing);
  grid_heights(scan, grid, options.gridding, threads, stop);
  return grid;
}

// Fills small holes; what rests on few pixels of an organised cloud was not measured either.
void finish(const CloudView& scan, const HeightMapOptions& options, HeightMap& map, int threads, const Stop& stop) {
  HoleFilling().run(map.heights, options.fill, map.measured, threads, stop);
  if (scan.organised()) clear_round(sparse_places(scan, threads, stop), sparse_reach * map.heights.spacing, map.measured);
}

}  // namespace

void HeightMapOptions::check() const {
  require(std::isfinite(spacing) && spacing >= 0, "spacing_mm", "a positive length in mm, or 0 for the median pitch", spacing);
  gridding.check();
  fill.check();
}

HeightMap height_map(const CloudView& scan, const CloudView& reference, const HeightMapOptions& options, int threads, const Stop& stop) {
  options.check();
  const CloudBounds box = bounds(reference, threads);
  require(box.seen > 0, "reference", "a cloud with points that were seen", "none");
  HeightMap map;
  map.heights = grid_scan(scan, box.low.head<2>(), box.high.head<2>(), options, threads, stop);
  Grid<float> below = map.heights.like<float>();
  grid_heights(reference, below, options.gridding, threads, stop);
  for (std::size_t k = 0; k < below.size(); ++k) map.heights.values[k] -= below.values[k];
  finish(scan, options, map, threads, stop);
  return map;
}

HeightMap height_map(const CloudView& scan, const Reference& reference, const HeightMapOptions& options, int threads, const Stop& stop) {
  options.check();
  const Grid<double>& domain = reference.heights();
  HeightMap map;
  map.heights = grid_scan(scan, domain.origin, domain.position(domain.nx - 1, domain.ny - 1), options, threads, stop);
  parallel_for(map.heights.ny, 8, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < map.heights.nx; ++i) {
        float& z = map.heights.at(i, j);
        if (!std::isnan(z)) z = static_cast<float>(z - reference.height(map.heights.position(i, j)));
      }
  });
  finish(scan, options, map, threads, stop);
  return map;
}

}  // namespace debulk
