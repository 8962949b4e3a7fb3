#include "debulk/ridge/bridge_hold.hpp"

#include <cmath>
#include <utility>

#include <Eigen/Geometry>

namespace debulk {
namespace {

// Mean sine of the crossing angles at a node; 1 where only one fibre runs. Parallel fibres are one spacing times this apart.
double crossing_sine(const Net& net, int node) {
  const Neighbours& around = net.neighbours[static_cast<std::size_t>(node)];
  const auto to = [&](int neighbour) {
    return (net.nodes[static_cast<std::size_t>(neighbour)] - net.nodes[static_cast<std::size_t>(node)]).normalized();
  };
  double sum = 0;
  int corners = 0;
  for (const Direction along : {east, west})
    for (const Direction across : {north, south})
      if (around[along] >= 0 && around[across] >= 0) {
        sum += to(around[along]).cross(to(around[across])).norm();
        ++corners;
      }
  return corners > 0 ? sum / corners : 1.0;
}

// By how much a section turns from its first segment to its last.
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
    const double apart = net.spacing * (crossing_sine(net, i) + crossing_sine(net, j)) / 2;
    for (const auto& [from, to] : {std::pair{i, j}, std::pair{j, i}})
      for (std::size_t d = 0; d < 4; ++d)
        if (net.neighbours[static_cast<std::size_t>(from)][d] == to) out.tension[static_cast<std::size_t>(from)][d] = tensions_n[k] / apart;
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
  out.drawn_in = out.tension > out.most &&
                 turning(net.nodes, section.nodes) * out.tension >= turning(net.feet, section.nodes) * out.most;
  return out;
}

}  // namespace debulk
