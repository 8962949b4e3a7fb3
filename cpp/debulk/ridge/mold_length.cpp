#include "debulk/ridge/mold_length.hpp"

#include <algorithm>
#include <string>

#include <Eigen/LU>

#include "debulk/core/error.hpp"

namespace debulk {

Eigen::Vector3d closest_point(const Surface& surface, const Eigen::Vector3d& point) {
  Eigen::Vector2d u = point.head<2>();
  for (int iteration = 0; iteration < 50; ++iteration) {
    // Newton's method on half the squared distance to (u, F(u)); Gauss-Newton where the surface curves too sharply for
    // that.
    const SurfaceSample s = surface.sample(u);
    const double above = point.z() - s.height;
    const Eigen::Vector2d descent = point.head<2>() - u + above * s.gradient;
    const Eigen::Matrix2d metric = Eigen::Matrix2d::Identity() + s.gradient * s.gradient.transpose();
    Eigen::Matrix2d curvature = metric - above * s.hessian;
    if (curvature.determinant() < 0.1 * metric.determinant() || curvature.trace() < 0) curvature = metric;
    const Eigen::Vector2d step = curvature.inverse() * descent;
    u += step;
    if (step.norm() < 1e-12 * (1 + u.norm())) break;
  }
  return {u.x(), u.y(), surface.height(u)};
}

double polyline_length(const std::vector<Eigen::Vector3d>& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

std::vector<std::vector<int>> fibres(const std::vector<Neighbours>& neighbours) {
  std::vector<std::vector<int>> out;
  for (const auto& [forward, backward] : {std::pair{east, west}, std::pair{north, south}})
    for (std::size_t first = 0; first < neighbours.size(); ++first) {
      if (neighbours[first][backward] >= 0 || neighbours[first][forward] < 0) continue;
      std::vector<int>& fibre = out.emplace_back();
      for (int n = static_cast<int>(first); n >= 0; n = neighbours[n][forward]) fibre.push_back(n);
    }
  return out;
}

double fibre_excess(const std::vector<Eigen::Vector3d>& ply, const Surface& surface) {
  const Eigen::Vector2d a = closest_point(surface, ply.front()).head<2>(), b = closest_point(surface, ply.back()).head<2>();
  std::vector<Eigen::Vector3d> mold;
  for (std::size_t i = 0; i < ply.size(); ++i) {
    const Eigen::Vector2d p = a + (b - a) * (static_cast<double>(i) / static_cast<double>(ply.size() - 1));
    mold.emplace_back(p.x(), p.y(), surface.height(p));
  }
  return polyline_length(ply) - polyline_length(mold);
}

double largest_fibre_excess(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours, const Surface& surface) {
  check_nodes(nodes, neighbours);
  double largest = 0;
  for (const std::vector<int>& fibre : fibres(neighbours)) {
    std::vector<Eigen::Vector3d> ply;
    for (const int n : fibre) ply.push_back(nodes[n]);
    largest = std::max(largest, fibre_excess(ply, surface));
  }
  return largest;
}

void check_nodes(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours) {
  for (std::size_t i = 0; i < nodes.size(); ++i)
    require(nodes[i].allFinite(), "nodes_mm", "finite coordinates", "a missing value at node " + std::to_string(i));
  require(neighbours.size() == nodes.size(), "neighbours", "one row (e, w, n, s) a node", std::to_string(neighbours.size()) + " rows");
  constexpr int opposite[] = {west, east, south, north};
  const int count = static_cast<int>(nodes.size());
  for (int i = 0; i < count; ++i)
    for (int d = 0; d < 4; ++d) {
      const int j = neighbours[i][d];
      const bool mutual = j == -1 || (j >= 0 && j < count && j != i && neighbours[j][opposite[d]] == i);
      require(mutual, "neighbours", "node numbers or -1, each pair naming one another",
              std::to_string(j) + " at row " + std::to_string(i) + ", column " + std::to_string(d));
    }
}

}  // namespace debulk
