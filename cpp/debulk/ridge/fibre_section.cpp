#include "debulk/ridge/fibre_section.hpp"

#include <algorithm>

namespace debulk {
namespace {

// Collects the nodes from `peak` (excluded) down along `direction`; returns false if a node higher than `peak` comes
// before the foot or valley.
bool descend(const DebulkedNet& net, int peak, Direction direction, double touch, std::vector<int>& path) {
  double lowest = net.gaps[peak];
  std::size_t kept = 0;
  for (int n = net.neighbours[peak][direction]; n >= 0 && n != peak; n = net.neighbours[n][direction]) {
    if (net.gaps[n] > lowest + touch && !path.empty()) break;  // the fibre rises again, so the valley has been passed
    if (net.gaps[n] > net.gaps[peak]) return false;
    path.push_back(n);
    if (net.gaps[n] <= lowest) {
      lowest = net.gaps[n];
      kept = path.size();
    }
    if (lowest <= touch) break;  // the foot
  }
  path.resize(kept);
  return true;
}

}  // namespace

std::optional<FibreSection> fibre_section(const DebulkedNet& net, int peak, int fibre, double touch) {
  std::vector<int> back, ahead;
  if (!descend(net, peak, fibre == 0 ? west : south, touch, back)) return std::nullopt;
  if (!descend(net, peak, fibre == 0 ? east : north, touch, ahead)) return std::nullopt;
  if (back.empty() && ahead.empty()) return std::nullopt;

  FibreSection section;
  section.peak = peak;
  section.fibre = fibre;
  section.nodes.assign(back.rbegin(), back.rend());
  section.nodes.push_back(peak);
  section.nodes.insert(section.nodes.end(), ahead.begin(), ahead.end());
  for (std::size_t k = 1; k < section.nodes.size(); ++k) {
    const int a = section.nodes[k - 1], b = section.nodes[k];
    section.ply_length += (net.nodes[b] - net.nodes[a]).norm();
    section.mold_length += (net.feet[b] - net.feet[a]).norm();
  }
  return section;
}

}  // namespace debulk
