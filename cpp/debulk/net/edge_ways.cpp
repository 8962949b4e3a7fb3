#include "debulk/net/edge_ways.hpp"

#include <algorithm>

#include "debulk/pocket/outline_search.hpp"

namespace debulk {

std::vector<double> ways_to_edge(const Net& net, const Polygon& ply) {
  const OutlineSearch outline(ply);
  std::vector<double> out;
  out.reserve(net.nodes.size());
  for (const Eigen::Vector3d& node : net.nodes) out.push_back(outline.distance(node.head<2>()));
  return out;
}

std::vector<std::array<double, 2>> ways_along_fibres(const Net& net, const Polygon& ply) {
  std::vector<std::array<double, 2>> out(net.nodes.size(), {0.0, 0.0});
  const OutlineSearch outline(ply);
  const auto xy = [&net](int node) { return Eigen::Vector2d(net.nodes[static_cast<std::size_t>(node)].head<2>()); };
  for (const int fibre : {0, 1}) {
    const Direction on = fibre == 0 ? east : north, back = fibre == 0 ? west : south;
    for (int first = 0; first < static_cast<int>(net.nodes.size()); ++first) {
      const int second = net.neighbours[static_cast<std::size_t>(first)][on];
      if (second < 0 || net.neighbours[static_cast<std::size_t>(first)][back] >= 0) continue;
      int last = second, before = first;
      for (int next = net.neighbours[static_cast<std::size_t>(last)][on]; next >= 0 && next != first;
           next = net.neighbours[static_cast<std::size_t>(last)][on]) {
        before = last;
        last = next;
      }
      const double way = std::min(outline.way_out(xy(first), (xy(first) - xy(second)).normalized()),
                                  outline.way_out(xy(last), (xy(last) - xy(before)).normalized()));
      for (int n = first; n >= 0; n = n == last ? -1 : net.neighbours[static_cast<std::size_t>(n)][on])
        out[static_cast<std::size_t>(n)][static_cast<std::size_t>(fibre)] = way;
    }
  }
  return out;
}

std::vector<double> ways_past_ends(const Net& net, const Polygon& ply) {
  std::vector<double> out(net.nodes.size(), 0.0);
  const OutlineSearch outline(ply);
  constexpr std::array<Direction, 4> opposite = {west, east, south, north};
  for (std::size_t i = 0; i < out.size(); ++i)
    for (const Direction on : {east, west, north, south}) {
      const int before = net.neighbours[i][opposite[on]];
      if (net.neighbours[i][on] >= 0 || before < 0) continue;
      const Eigen::Vector2d end = net.nodes[i].head<2>();
      out[i] = std::max(out[i], outline.way_out(end, (end - net.nodes[static_cast<std::size_t>(before)].head<2>()).normalized()));
    }
  return out;
}

}  // namespace debulk
