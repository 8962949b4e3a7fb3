#include "debulk/ridge/post_process.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "debulk/core/error.hpp"
#include "debulk/ridge/mold_length.hpp"
#include "debulk/ridge/ridge_height.hpp"

namespace debulk {
namespace {

// A section that is shorter than its mold by more than this, relative to its length, cannot be pressed onto it. The
// value is the strain that a certificate allows.
constexpr double kTautStrain = 1e-4;

void check_input(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours,
                 const std::vector<std::uint8_t>& inside) {
  check_nodes(nodes, neighbours);
  require(inside.size() == nodes.size(), "inside", "one value per node", std::to_string(inside.size()) + " values");
  require(std::any_of(inside.begin(), inside.end(), [](std::uint8_t i) { return i != 0; }), "inside",
          "at least one node inside the perimeter", "none of " + std::to_string(inside.size()));
}

// Returns the nodes that do not touch the mold, from the highest down; ties by number.
std::vector<int> from_the_highest(const std::vector<double>& gaps, double touch) {
  std::vector<int> order;
  for (std::size_t i = 0; i < gaps.size(); ++i)
    if (gaps[i] > touch) order.push_back(static_cast<int>(i));
  std::sort(order.begin(), order.end(), [&gaps](int a, int b) { return gaps[a] != gaps[b] ? gaps[a] > gaps[b] : a < b; });
  return order;
}

// Returns the sections through a node along its fibres, the one with the larger excess per length first; none if the
// node is on the flank of both fibres.
std::vector<FibreSection> sections_at(const DebulkedNet& net, int peak, double touch) {
  std::vector<FibreSection> sections;
  for (const int fibre : {0, 1})
    if (std::optional<FibreSection> section = fibre_section(net, peak, fibre, touch)) sections.push_back(std::move(*section));
  if (sections.size() == 2 && sections[1].excess_per_length() > sections[0].excess_per_length()) std::swap(sections[0], sections[1]);
  return sections;
}

// Marks the peak and the nodes between the ends, except those that an earlier section has marked; returns the nodes it
// marked.
std::vector<int> claim(const FibreSection& section, std::vector<std::uint8_t>& claimed) {
  std::vector<int> marked;
  for (const int n : section.nodes) {
    const bool end = n == section.nodes.front() || n == section.nodes.back();
    if (claimed[n] || (end && n != section.peak)) continue;
    claimed[n] = 1;
    marked.push_back(n);
  }
  return marked;
}

// Returns the RMS over the nodes that are `inside` and not `without`. It is computed relative to `scale`, so that gaps
// that all equal `scale` give exactly `scale`; it is also `scale` if there are no such nodes.
double rms_inside(const std::vector<double>& gaps, const std::vector<std::uint8_t>& inside, const std::vector<std::uint8_t>& without,
                  double scale) {
  double sum = 0;
  long count = 0;
  for (std::size_t i = 0; i < gaps.size(); ++i)
    if (inside[i] && !without[i]) {
      sum += (gaps[i] / scale) * (gaps[i] / scale);
      ++count;
    }
  return count > 0 ? scale * std::sqrt(sum / static_cast<double>(count)) : scale;
}

// The section that bridges: the tautest, or else one that friction holds. It is null if no fibre is too short.
struct Bridge {
  const FibreSection* section = nullptr;
  Pull pull;
};
Bridge bridge_of(const DebulkedNet& net, const std::vector<FibreSection>& sections, const BridgeHold& hold) {
  Bridge out;
  for (auto section = sections.rbegin(); section != sections.rend(); ++section) {
    if (section->excess_per_length() >= -kTautStrain) continue;
    const Pull pull = hold.most.empty() ? Pull() : pull_of(net, *section, hold);
    if (out.section == nullptr || !pull.drawn_in) out = {&*section, pull};
    if (!pull.drawn_in) break;
  }
  return out;
}

}  // namespace

void RidgeOptions::check() const {
  require(std::isfinite(thickness) && thickness > 0, "thickness_mm", "a positive thickness in mm", thickness);
  require(std::isfinite(bulk_factor) && bulk_factor >= 1, "bulk_factor", "at least 1", bulk_factor);
  require(std::isfinite(touch) && touch >= 0, "touch_mm", "a gap in mm, or 0 for a thirtieth of the thickness", touch);
}

PostProcessed post_process(const std::vector<Eigen::Vector3d>& nodes, const std::vector<Neighbours>& neighbours,
                           const std::vector<std::uint8_t>& inside, const Surface& surface, const RidgeOptions& options,
                           const BridgeHold& hold) {
  options.check();
  check_input(nodes, neighbours, inside);

  std::vector<double> gaps(nodes.size());
  std::vector<Eigen::Vector3d> feet(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    gaps[i] = nodes[i].z() - surface.height(nodes[i].head<2>());
    feet[i] = closest_point(surface, nodes[i]);
  }
  const DebulkedNet net{nodes, feet, gaps, neighbours};
  const double base = options.consolidated(), touch = options.touch_gap();

  PostProcessed out;
  out.gaps.assign(nodes.size(), base);
  out.is_ridge.assign(nodes.size(), 0);
  out.is_bridge.assign(nodes.size(), 0);
  out.drawn_in.assign(nodes.size(), 0);
  std::vector<std::uint8_t> claimed(nodes.size(), 0);

  for (const int peak : from_the_highest(gaps, touch)) {
    if (claimed[peak]) continue;
    const std::vector<FibreSection> sections = sections_at(net, peak, touch);
    if (sections.empty()) continue;

    const double height = ridge_height_of_excess(sections.front().excess(), options.thickness);
    if (height > base) {
      claim(sections.front(), claimed);
      out.is_ridge[peak] = 1;
      out.gaps[peak] = height;
      out.ridge_height = std::max(out.ridge_height, height);
      out.sections.push_back({sections.front(), height, 0.0});
    } else if (const Bridge bridge = bridge_of(net, sections, hold); bridge.section != nullptr) {
      if (bridge.pull.drawn_in && gaps[peak] + base > out.drawn_in_height) {
        out.drawn_in_height = gaps[peak] + base;
        out.drawn_in_pull = bridge.pull;
      }
      for (const int n : claim(*bridge.section, claimed)) {
        if (bridge.pull.drawn_in) {
          out.drawn_in[n] = 1;
          continue;
        }
        out.is_bridge[n] = 1;
        out.gaps[n] = gaps[n] + base;
        out.bridge_height = std::max(out.bridge_height, out.gaps[n]);
      }
    }  // otherwise the top closes and claims nothing, because its other nodes may be tops across
  }

  out.ridge_length = measure_ridge_lines(net, out.sections);
  out.rms = rms_inside(out.gaps, inside, out.drawn_in, base);
  out.excess_length = largest_fibre_excess(nodes, neighbours, surface);
  return out;
}

}  // namespace debulk
