#include "debulk/ridge/ridge_line.hpp"

#include <algorithm>
#include <numeric>

namespace debulk {

double measure_ridge_lines(const DebulkedNet& net, std::vector<RidgeSection>& sections) {
  std::vector<int> section_of(net.nodes.size(), -1);
  for (std::size_t s = 0; s < sections.size(); ++s) section_of[sections[s].peak] = static_cast<int>(s);

  // Connected sections share a root.
  std::vector<int> root(sections.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&root](int s) {
    while (root[s] != s) s = root[s] = root[root[s]];
    return s;
  };

  for (RidgeSection& section : sections) {
    const Direction across[] = {section.fibre == 0 ? north : east, section.fibre == 0 ? south : west};
    const Direction along[] = {section.fibre == 0 ? east : north, section.fibre == 0 ? west : south};
    const double spacing = section.ply_length / static_cast<double>(section.nodes.size() - 1);
    section.length = 0;
    for (const Direction side : across) {
      double way = -1;
      const int next = net.neighbours[section.peak][side];
      if (next >= 0)
        for (const int candidate : {next, net.neighbours[next][along[0]], net.neighbours[next][along[1]]}) {
          if (candidate < 0 || section_of[candidate] < 0) continue;
          const double distance = (net.feet[candidate] - net.feet[section.peak]).norm();
          way = way < 0 ? distance : std::min(way, distance);
          root[find(section_of[candidate])] = find(section_of[section.peak]);
        }
      section.length += (way < 0 ? spacing : way) / 2;
    }
  }

  std::vector<double> total(sections.size(), 0.0);
  for (std::size_t s = 0; s < sections.size(); ++s) total[find(static_cast<int>(s))] += sections[s].length;
  return total.empty() ? 0.0 : *std::max_element(total.begin(), total.end());
}

}  // namespace debulk
