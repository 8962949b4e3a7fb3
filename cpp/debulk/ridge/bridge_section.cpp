#include "debulk/ridge/bridge_section.hpp"

#include <algorithm>
#include <tuple>

#include "debulk/pocket/outline_search.hpp"
#include "debulk/ridge/taut_string.hpp"

namespace debulk {
namespace {

constexpr double kStep = 1.0;      // mm, along a fibre
constexpr double kAround = 40.0;   // mm of laid ply beyond each end, over which the string may come off the mold as well
constexpr double kEnds = 10.0;     // mm, uncertainty of the place where the ply comes down and friction begins to hold
constexpr double kStraight = 1e5;  // mm, radius of a string that is practically straight
constexpr double kResolved = 8.0;  // mm; round a corner of the mold the filters leave a shorter bridge that is none

}  // namespace

BridgeSection bridge_section(const std::vector<ShortFibre>& fibres, const Surface& mold, const BridgeSectionOptions& options,
                             const Stop& stop) {
  const Box& known = options.mold_known;
  const Polygon corners{known.low, {known.high.x(), known.low.y()}, known.high, {known.low.x(), known.high.y()}};
  const OutlineSearch edge(options.ply.empty() ? corners : options.ply), border(corners);
  BridgeSection out;
  for (const ShortFibre& fibre : fibres) {
    if (stop.now()) throw Stopped("the sections of the fibres over a pocket were not all weighed");
    const double length = (fibre.to - fibre.from).norm();
    if (!(fibre.lacks > 0 && length > 0)) continue;
    const Eigen::Vector2d along = (fibre.to - fibre.from) / length;
    const double back = edge.way_out(fibre.from, -along), on = edge.way_out(fibre.to, along);
    const double begin = -std::min({kAround, back, border.way_out(fibre.from, -along)});
    const double end = length + std::min({kAround, on, border.way_out(fibre.to, along)});
    MoldSection section;
    section.step = kStep;
    for (double s = begin; s <= end; s += kStep) section.heights.push_back(mold.height(fibre.from + s * along));

    const double radius = options.friction * std::min(back, on), ends = options.friction * kEnds;
    const auto gap = [&section](double lacks, double most) { return taut_string_lacking(section, lacks, most).gap; };
    out.most_gap = std::max(out.most_gap, gap(fibre.most, radius + ends));
    const double least = length < kResolved ? 0.0 : gap(fibre.lacks - fibre.error, radius - ends), nominal = gap(fibre.lacks, radius);
    if (std::tie(least, nominal, fibre.lacks) <= std::tie(out.least_gap, out.gap, out.lacks)) continue;
    out.least_gap = least, out.gap = nominal, out.lacks = fibre.lacks, out.error = fibre.error;
    out.pull = options.pressure * taut_string_lacking(section, fibre.lacks, kStraight).radius;
    out.hold = options.pressure * radius;
  }
  return out;
}

}  // namespace debulk
