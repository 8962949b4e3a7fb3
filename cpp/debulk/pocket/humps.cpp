#include "debulk/pocket/humps.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "debulk/pocket/hump_map.hpp"
#include "debulk/pocket/hump_shape.hpp"
#include "debulk/pocket/hump_tops.hpp"

namespace debulk {
namespace {

constexpr std::array kRadii{25.0, 40.0, 65.0, 100.0};  // mm, of the hump; the ring reaches to nearly twice as far
constexpr double kCells = 12;                          // along a radius: with half as many, a bell 24 mm wide loses half of its excess
constexpr std::size_t kMost = 30;                      // tops that are tried of each kind at each radius
constexpr double kLeastArea = 60;                      // mm2 above half its height: what is smaller is a flaw of the scan

bool covers(const Hump& hump, const Eigen::Vector2d& place) {
  return (place - hump.top).norm() <= std::max(kRadii[0], std::sqrt(hump.area));
}

}  // namespace

std::vector<Hump> find_humps(const Grid<float>& seen, const Polygon& ply, const std::vector<double>& angles, const Stop& stop) {
  std::vector<Hump> out;
  Grid<float> whole = seen;
  for (const double radius : kRadii) {
    whole = hump_map(whole, radius / kCells);
    const double cells = radius / whole.spacing;
    // As far as a ring round what lies on a ring round a place of the ply.
    const Grid<float> map = ply.empty() ? whole : part_of(whole, bounding_box(ply), static_cast<int>(2 * kRingEnd * cells + cells));
    const PlyMask mask = ply.empty() ? PlyMask() : PlyMask(ply, map);
    for (const HumpTop& top : hump_tops(map, cells, mask, kMost)) {
      if (stop.now()) throw Stopped("the computation was stopped");
      const Eigen::Vector2d place = map.position(top.i, top.j);
      if (top.way && std::any_of(out.begin(), out.end(), [&](const Hump& one) { return covers(one, place); })) continue;
      if (const auto shape = hump_shape(map, top, cells, angles); shape && shape->area >= kLeastArea)
        out.push_back({place, shape->height, shape->area, shape->excess, map.spacing});
    }
  }
  return out;
}

}  // namespace debulk
