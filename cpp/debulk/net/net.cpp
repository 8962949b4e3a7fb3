#include "debulk/net/net.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <Eigen/Geometry>

namespace debulk {

std::vector<std::array<int, 2>> segments(const std::vector<Neighbours>& neighbours) {
  std::vector<std::array<int, 2>> out;
  for (std::size_t i = 0; i < neighbours.size(); ++i)
    for (const int j : neighbours[i])
      if (j > static_cast<int>(i)) out.push_back({static_cast<int>(i), j});
  return out;
}

int bandwidth(const std::vector<Neighbours>& neighbours) {
  int widest = 0;
  for (std::size_t i = 0; i < neighbours.size(); ++i)
    for (const int j : neighbours[i])
      if (j >= 0) widest = std::max(widest, std::abs(j - static_cast<int>(i)));
  return widest;
}

std::vector<double> shear_angles(const Net& net) {
  const double right_angle = std::acos(0.0);
  std::vector<double> out(net.nodes.size(), 0.0);
  for (std::size_t i = 0; i < net.nodes.size(); ++i) {
    double sum = 0;
    int pairs = 0;
    for (const Direction first : {east, west})
      for (const Direction second : {north, south}) {
        const int a = net.neighbours[i][first], b = net.neighbours[i][second];
        if (a < 0 || b < 0) continue;
        // Reversing one fibre's direction gives the supplementary angle, which is equally far from 90 degrees.
        const Eigen::Vector3d u = net.nodes[a] - net.nodes[i], v = net.nodes[b] - net.nodes[i];
        sum += std::abs(right_angle - std::atan2(u.cross(v).norm(), u.dot(v)));
        ++pairs;
      }
    if (pairs > 0) out[i] = sum / pairs;
  }
  return out;
}

}  // namespace debulk
