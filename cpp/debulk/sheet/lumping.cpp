#include "debulk/sheet/lumping.hpp"

#include <algorithm>

#include <Eigen/Geometry>

namespace debulk {

std::vector<double> nodal_areas(const Net& net, Lumping lumping, double area_mm2) {
  const double even = area_mm2 / static_cast<double>(net.nodes.size());
  std::vector<double> out(net.nodes.size(), lumping == Lumping::paper ? even : 0.0);
  if (lumping == Lumping::paper) return out;
  for (std::size_t i = 0; i < out.size(); ++i)
    for (const Direction along : {east, west})
      for (const Direction across : {north, south}) {
        const int a = net.neighbours[i][along], b = net.neighbours[i][across];
        if (a < 0 || b < 0) continue;
        const Eigen::Vector3d to_a = net.nodes[static_cast<std::size_t>(a)] - net.nodes[i];
        out[i] += to_a.cross(net.nodes[static_cast<std::size_t>(b)] - net.nodes[i]).norm() / 4;
      }
  if (std::all_of(out.begin(), out.end(), [](double area) { return area == 0; })) std::fill(out.begin(), out.end(), even);
  return out;
}

std::vector<double> gripping_areas(const Net& net, const std::vector<int>& free, Lumping lumping, double area_mm2) {
  std::vector<double> out(free.size(), area_mm2 / static_cast<double>(net.nodes.size()));
  if (lumping == Lumping::paper) return out;
  for (std::size_t k = 0; k < free.size(); ++k) {
    const double way = net.to_edge.empty() ? net.spacing / 2 : net.to_edge[static_cast<std::size_t>(free[k])];
    out[k] = net.spacing * way;
  }
  return out;
}

}  // namespace debulk
