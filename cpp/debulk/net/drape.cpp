#include "debulk/net/drape.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/net/spread.hpp"
#include "debulk/pocket/cross.hpp"
#include "debulk/pocket/outline_search.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;

}  // namespace

Drape::Drape(const Surface& surface, const Vector2d& seed, const FibreAngles& angles, double spacing, const std::vector<Vector2d>& outline,
             const LayOptions& options) {
  const Polygon ply = checked_polygon(outline, "outline_mm");
  const Box box = bounding_box(ply);
  const bool within = ((seed - box.low).array() >= 0).all() && ((box.high - seed).array() >= 0).all();
  require(within, "seed_mm", "a point in the box about the outline",
          "(" + std::to_string(seed.x()) + ", " + std::to_string(seed.y()) + ")");

  FibreRays rays = fibre_rays(surface, seed, angles, spacing / kStepsPerSegment, options.paths);
  const NetDomain region = fibre_parallelogram(ply, seed, angles, 2 * spacing);
  NetLayer layer(surface, rays, angles, spacing, region, options);
  const Vector2d size = (box.high - box.low) / spacing;
  layer.check_size(size.x() * size.y());

  // A cell's corner may lie as far as a diagonal, at most two segments, from the points in the cell.
  const OutlineSearch edge(ply);
  const auto covers = [&](const Vector2d& p) {
    if (((p - box.low).array() < -2 * spacing).any() || ((p - box.high).array() > 2 * spacing).any()) return false;
    return edge.inside(p) || edge.within(p, 2 * spacing);
  };
  std::vector<std::array<int, 2>> covering;
  spread(layer, [&](int i, int j, const Eigen::Vector3d& node) {
    const bool covered = covers(node.head<2>());
    if (covered) covering.push_back({i, j});
    return covered || covering.empty();  // from a seed beside the ply, the net goes on to the ply
  });
  const Lattice lattice = layer.lattice();
  std::vector<std::uint8_t> keep(lattice.nodes.size());
  for (const auto& [i, j] : covering) keep[lattice.index(i, j)] = 1;
  net_ = number_nodes(lattice, keep);
  for (std::size_t k = 0; k < net_.nodes.size(); ++k) net_.inside[k] = edge.inside(net_.nodes[k].head<2>());

  for (std::size_t k = 0; k < net_.nodes.size(); ++k) {
    const int e = net_.neighbours[k][east], n = net_.neighbours[k][north];
    const int opposite = e < 0 ? -1 : net_.neighbours[e][north];
    if (n >= 0 && opposite >= 0 && net_.neighbours[n][east] == opposite) cells_.push_back({static_cast<int>(k), e, n, opposite});
  }
  Polygon points;
  for (const Eigen::Vector3d& p : net_.nodes) points.emplace_back(p.head<2>());
  const Box all = bounding_box(points);
  origin_ = all.low;
  bucket_ = 2 * spacing;
  columns_ = 1 + static_cast<int>((all.high.x() - all.low.x()) / bucket_);
  rows_ = 1 + static_cast<int>((all.high.y() - all.low.y()) / bucket_);
  buckets_.resize(static_cast<std::size_t>(columns_) * rows_);
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    Polygon corners;
    for (const int k : cells_[c]) corners.push_back(points[k]);
    const Box around = bounding_box(corners);
    const Eigen::Vector2i low = ((around.low - origin_) / bucket_).cast<int>(), high = ((around.high - origin_) / bucket_).cast<int>();
    for (int j = low.y(); j <= high.y(); ++j)
      for (int i = low.x(); i <= high.x(); ++i) buckets_[static_cast<std::size_t>(j) * columns_ + i].push_back(static_cast<int>(c));
  }
}

std::optional<FibreAngles> Drape::fibre_angles(const Vector2d& xy) const {
  const Vector2d q = (xy - origin_) / bucket_;
  if (!(q.x() >= 0 && q.y() >= 0 && q.x() < columns_ && q.y() < rows_)) return std::nullopt;
  for (const int c : buckets_[static_cast<std::size_t>(q.y()) * columns_ + static_cast<std::size_t>(q.x())])
    if (const auto angles = angles_in(cells_[c], xy)) return angles;
  return std::nullopt;
}

std::optional<FibreAngles> Drape::angles_in(const Cell& cell, const Vector2d& xy) const {
  // The cell seen from above is p + u a + v b + u v d. Solve for (u, v) by Newton's method from its middle; a convex
  // cell has one solution.
  const Vector2d p = net_.nodes[cell[0]].head<2>();
  const Vector2d a = net_.nodes[cell[1]].head<2>() - p, b = net_.nodes[cell[2]].head<2>() - p;
  const Vector2d d = net_.nodes[cell[3]].head<2>() - p - a - b;
  double u = 0.5, v = 0.5;
  Vector2d first = a, second = b;
  for (int step = 0; step < 12; ++step) {
    first = a + v * d;
    second = b + u * d;
    const double area = cross(first, second);
    if (area == 0) return std::nullopt;
    const Vector2d miss = xy - (p + u * a + v * b + u * v * d);
    const double du = cross(miss, second) / area, dv = cross(first, miss) / area;
    u += du;
    v += dv;
    if (std::max(std::abs(du), std::abs(dv)) < 1e-13) break;
  }
  constexpr double slack = 1e-9;  // a point on a side belongs to the cells on both sides of it
  if (!(u >= -slack && u <= 1 + slack && v >= -slack && v <= 1 + slack)) return std::nullopt;
  first = a + v * d;
  second = b + u * d;
  return FibreAngles{std::atan2(first.y(), first.x()), std::atan2(second.y(), second.x())};
}

}  // namespace debulk
