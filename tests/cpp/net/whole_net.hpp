#pragma once

#include <vector>

#include "debulk/net/lay.hpp"

namespace debulk {

// Lays all nodes of a net that can be laid in a region.
inline Lattice lay_net(const Surface& surface, const Eigen::Vector2d& centre, const FibreAngles& angles, double spacing,
                       const NetDomain& region, const LayOptions& options = {}) {
  FibreRays rays = fibre_rays(surface, centre, angles, spacing / kStepsPerSegment, options.paths);
  NetLayer layer(surface, rays, angles, spacing, region, options);
  const auto path = [&](int di, int dj) {
    int n = 0;
    while (layer.at((n + 1) * di, (n + 1) * dj) != nullptr) ++n;
    return n;
  };
  const int n_east = path(1, 0), n_west = path(-1, 0), n_north = path(0, 1), n_south = path(0, -1);
  layer.check_size((n_west + 1.0 + n_east) * (n_south + 1.0 + n_north));
  for (int j = -n_south; j <= n_north; ++j)
    for (int i = -n_west; i <= n_east; ++i) layer.at(i, j);
  return layer.lattice();
}

// Returns the nodes of a fibre's path without its start, at most `limit` of them.
inline std::vector<Eigen::Vector3d> fibre_path(const Surface& surface, const Eigen::Vector2d& start, double angle, double spacing,
                                               PathRule rule, const NetDomain& region, long limit) {
  FibreRay ray(surface, start, angle, spacing / kStepsPerSegment, rule);
  RayNodes path(ray, spacing, region);
  std::vector<Eigen::Vector3d> nodes;
  while (static_cast<long>(nodes.size()) < limit) {
    const Eigen::Vector3d* next = path.node(nodes.size() + 1);
    if (next == nullptr) break;
    nodes.push_back(*next);
  }
  return nodes;
}

}  // namespace debulk
