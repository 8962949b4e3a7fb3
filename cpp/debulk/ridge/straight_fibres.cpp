#include "debulk/ridge/straight_fibres.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/pocket/foot_heights.hpp"

namespace debulk {
namespace {

constexpr double kApart = 2.0;  // mm; what the filters leave is 8 mm wide
constexpr double kStep = 1.5;   // mm, at least
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Of the steps whose ends both are known.
double excess_of(const StraightFibre& line, double step) {
  double excess = 0;
  for (std::size_t k = 1; k < line.gaps.size(); ++k) {
    const double rise = line.molds[k] - line.molds[k - 1], longer = std::hypot(step, rise + line.gaps[k] - line.gaps[k - 1]);
    if (!std::isnan(longer)) excess += longer - std::hypot(step, rise);
  }
  return excess;
}

// Half way there, and there: an outline between two of the places is missed.
bool goes_on(const StraightFibre& line, const Eigen::Vector2d& way, const LinesHeld& held) {
  if (held.over <= 0 || held.ply.empty()) return true;
  for (const double share : {0.1, 0.5, 1.0}) {
    const Eigen::Vector2d beyond = share * held.over * way;
    if (!inside(held.ply, line.points.front() - beyond) || !inside(held.ply, line.points.back() + beyond)) return false;
  }
  return true;
}

struct Frame {
  Eigen::Vector2d origin, along;
  double step;

  Eigen::Vector2d at(int k, double aside) const { return origin + k * step * along + aside * Eigen::Vector2d(-along.y(), along.x()); }
};

// Unknown: on the mold.
double lower_side(double height, double thickness) {
  return std::isnan(height) ? 0.0 : std::max(height - thickness, 0.0);
}

// The pieces of a line, each from its first point on the foot to its last.
std::vector<StraightFibre> lines_over(const FootHeights& ply, double thickness, const Surface& mold, const Frame& frame, int reach,
                                      double aside, double apart) {
  std::vector<StraightFibre> lines;
  int last = 0;  // point on the foot
  for (int k = -reach; k <= reach; ++k) {
    const Eigen::Vector2d xy = frame.at(k, aside);
    if (!ply.on_foot(xy)) continue;
    if (lines.empty() || (k - last) * frame.step > apart) lines.emplace_back(), last = k - 1;
    StraightFibre& line = lines.back();
    for (++last; last < k; ++last) {
      line.points.push_back(frame.at(last, aside));
      line.gaps.push_back(kUnknown), line.molds.push_back(kUnknown);
    }
    line.points.push_back(xy);
    line.gaps.push_back(lower_side(ply.at(xy), thickness));
    line.molds.push_back(mold.height(xy));
  }
  for (StraightFibre& line : lines) line.excess = excess_of(line, frame.step);
  return lines;
}

}  // namespace

std::vector<StraightFibre> straight_fibres(const FootMap& feet, const Foot& foot, const Surface& mold, const FibreAngles& angles,
                                           const LinesHeld& held, const Stop& stop) {
  std::vector<StraightFibre> out(angles.size());
  if (foot.outline.empty()) return out;
  const FootHeights ply(feet, foot);
  const Box box = bounding_box(foot.outline);
  const double half = 0.5 * (box.high - box.low).norm(), step = std::max(kStep, feet.heights.spacing);
  const int reach = static_cast<int>(half / step) + 1, aside = static_cast<int>(half / kApart) + 1;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const Frame frame{0.5 * (box.low + box.high), {std::cos(angles[k]), std::sin(angles[k])}, step};
    for (int n = -aside; n <= aside; ++n) {
      if (stop.now()) throw Stopped("straight lines along the fibres were not all measured");
      for (StraightFibre& line : lines_over(ply, feet.options.thickness_mm, mold, frame, reach, n * kApart, held.apart))
        if (line.excess > out[k].excess && goes_on(line, frame.along, held)) out[k] = std::move(line);
    }
  }
  return out;
}

}  // namespace debulk
