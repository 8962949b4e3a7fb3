#include <utility>

#include "debulk/net/lay.hpp"

namespace debulk {
namespace {

Net numbered_along(const Lattice& lattice, const std::vector<std::uint8_t>& keep, bool first_fibre) {
  Net net;
  net.spacing = lattice.spacing;
  std::vector<int> number(lattice.nodes.size(), -1);
  const auto add = [&](int i, int j) {
    const std::size_t place = lattice.index(i, j);
    if (!keep[place] || !lattice.has(i, j)) return;
    number[place] = static_cast<int>(net.nodes.size());
    net.nodes.push_back(lattice.nodes[place]);
    net.lattice.push_back({i, j});
  };
  if (first_fibre) {
    for (int j = lattice.south; j <= lattice.north; ++j)
      for (int i = lattice.west; i <= lattice.east; ++i) add(i, j);
  } else {
    for (int i = lattice.west; i <= lattice.east; ++i)
      for (int j = lattice.south; j <= lattice.north; ++j) add(i, j);
  }
  const auto at = [&](int i, int j) {
    const bool within = i >= lattice.west && i <= lattice.east && j >= lattice.south && j <= lattice.north;
    return within ? number[lattice.index(i, j)] : -1;
  };
  for (const auto& [i, j] : net.lattice) net.neighbours.push_back({at(i + 1, j), at(i - 1, j), at(i, j + 1), at(i, j - 1)});
  net.kinds.assign(net.nodes.size(), NodeKind::inner);
  net.inside.assign(net.nodes.size(), 0);
  return net;
}

}  // namespace

Net number_nodes(const Lattice& lattice, const std::vector<std::uint8_t>& keep) {
  Net by_first = numbered_along(lattice, keep, true), by_second = numbered_along(lattice, keep, false);
  return bandwidth(by_second.neighbours) < bandwidth(by_first.neighbours) ? std::move(by_second) : std::move(by_first);
}

}  // namespace debulk
