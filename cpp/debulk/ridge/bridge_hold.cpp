#include "debulk/ridge/bridge_hold.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace debulk {
namespace {

// Returns the width of the strip of ply that a fibre represents at one of its nodes, mm: on each side half the distance
// to the next fibre, if the net has one there; one spacing if it has none on either side.
double width_at(const Net& net, int node, int fibre) {
  const Neighbours& around = net.neighbours[static_cast<std::size_t>(node)];
  const auto to = [&](int neighbour) -> Eigen::Vector3d {
    return (net.nodes[static_cast<std::size_t>(neighbour)] - net.nodes[static_cast<std::size_t>(node)]).normalized();
  };
  const std::array<Direction, 2> ends = {east, west}, sides = {north, south};
  double width = 0;
  for (const Direction across : fibre == 0 ? sides : ends) {
    double sines = 0;
    int corners = 0;
    for (const Direction along : fibre == 0 ? ends : sides)
      if (around[along] >= 0 && around[across] >= 0) {
        sines += to(around[along]).cross(to(around[across])).norm();
        ++corners;
      }
    if (corners > 0) width += net.spacing / 2 * sines / corners;
  }
  return width > 0 ? width : net.spacing;
}

// Returns the angle by which a section turns from its first segment to its last, radians.
double turning(const std::vector<Eigen::Vector3d>& points, const std::vector<int>& nodes) {
  const Eigen::Vector3d first = points[static_cast<std::size_t>(nodes[1])] - points[static_cast<std::size_t>(nodes[0])];
  const Eigen::Vector3d last = points[static_cast<std::size_t>(nodes.back())] - points[static_cast<std::size_t>(nodes[nodes.size() - 2])];
  return std::atan2(first.cross(last).norm(), first.dot(last));
}

}  // namespace

BridgeHold bridge_hold(const PocketNet& laid, const std::vector<double>& tensions_n, double friction, double pressure_mpa) {
  if (tensions_n.empty() || laid.hold_ways.empty()) return {};
  BridgeHold out;
  const Net& net = laid.net;
  out.tension.assign(net.nodes.size(), {0.0, 0.0, 0.0, 0.0});
  const std::vector<std::array<int, 2>> all = segments(net.neighbours);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto [i, j] = all[k];
    for (const auto& [from, to] : {std::pair{i, j}, std::pair{j, i}})
      for (std::size_t d = 0; d < 4; ++d)
        if (net.neighbours[static_cast<std::size_t>(from)][d] == to) {
          const int fibre = d < 2 ? 0 : 1;
          out.tension[static_cast<std::size_t>(from)][d] = 2 * tensions_n[k] / (width_at(net, from, fibre) + width_at(net, to, fibre));
        }
  }
  for (const std::array<double, 2>& ways : laid.hold_ways)
    out.most.push_back({friction * pressure_mpa * ways[0], friction * pressure_mpa * ways[1]});
  return out;
}

Pull pull_of(const DebulkedNet& net, const FibreSection& section, const BridgeHold& hold) {
  Pull out;
  const Direction on = section.fibre == 0 ? east : north;
  for (std::size_t k = 0; k + 1 < section.nodes.size(); ++k) out.tension += hold.tension[static_cast<std::size_t>(section.nodes[k])][on];
  out.tension /= static_cast<double>(section.nodes.size() - 1);
  out.most = hold.most[static_cast<std::size_t>(section.peak)][static_cast<std::size_t>(section.fibre)];
  out.drawn_in = out.tension > out.most && turning(net.nodes, section.nodes) * out.tension >= turning(net.feet, section.nodes) * out.most;
  return out;
}

}  // namespace debulk
