#include "debulk/ridge/straight_fibres.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/pocket/foot_heights.hpp"

namespace debulk {
namespace {

constexpr double kApart = 2.0;      // mm; a bump that the filters leave is 8 mm wide
constexpr double kStep = 1.0;       // mm, least step: a step of 1.5 takes 4 % from a bump 18 mm wide, this one 2 %
constexpr double kEdgeCells = 2.0;  // width, in grid cells, of the border of the ply in which heights may not be known
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// Returns the excess of the steps whose two ends are known.
double excess_of(const StraightFibre& line, double step) {
  double excess = 0;
  for (std::size_t k = 1; k < line.gaps.size(); ++k) {
    const double rise = line.molds[k] - line.molds[k - 1], longer = std::hypot(step, rise + line.gaps[k] - line.gaps[k - 1]);
    if (!std::isnan(longer)) excess += longer - std::hypot(step, rise);
  }
  return excess;
}

// Whether the ply continues for held.over beyond both ends. It is tested at a tenth of this distance, at half of it and
// at the whole; a gap in the ply between two of these places is missed.
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

// Returns the height of the ply's lower side; where the height is not known, the ply is taken to lie on the mold.
double lower_side(double height, double thickness) {
  return std::isnan(height) ? 0.0 : std::max(height - thickness, 0.0);
}

// Whether a place without a height is so near the ply's edge that the line ends there instead of stepping down to the
// mold.
bool ends_before(const Eigen::Vector2d& xy, const LinesHeld& held, double spacing) {
  return !held.ply.empty() && distance_to_outline(held.ply, xy) <= kEdgeCells * spacing;
}

// Returns the whole line, from its first point on the foot to its last.
StraightFibre line_over(const FootHeights& ply, const FootMap& feet, const Surface& mold, const LinesHeld& held, const Frame& frame,
                        int reach, double aside) {
  StraightFibre line;
  int last = -1;  // index of its last point on the foot
  for (int k = -reach; k <= reach; ++k) {
    const Eigen::Vector2d xy = frame.at(k, aside);
    bool on = ply.on_foot(xy);
    const double height = on ? ply.at(xy) : kUnknown;
    if (on && std::isnan(height)) on = !ends_before(xy, held, feet.heights.spacing);
    if (!on && last < 0) continue;
    line.points.push_back(xy);
    line.gaps.push_back(on ? lower_side(height, feet.options.thickness_mm) : kUnknown);
    line.molds.push_back(on ? mold.height(xy) : kUnknown);
    if (on) last = static_cast<int>(line.points.size()) - 1;
  }
  line.points.resize(last + 1), line.gaps.resize(last + 1), line.molds.resize(last + 1);
  return line;
}

StraightFibre part_of(const StraightFibre& line, int first, int end) {
  StraightFibre part;
  part.points.assign(line.points.begin() + first, line.points.begin() + end);
  part.gaps.assign(line.gaps.begin() + first, line.gaps.begin() + end);
  part.molds.assign(line.molds.begin() + first, line.molds.begin() + end);
  return part;
}

// Divides the line in the middle of each stretch that lies on the mold for longer than `apart`, off the foot or on it:
// the foot of a ring-shaped pocket is the whole disc.
std::vector<StraightFibre> parted(StraightFibre line, double tolerance, double step, double apart) {
  std::vector<StraightFibre> parts;
  const int count = static_cast<int>(line.gaps.size());
  int first = 0, stood = -1;
  for (int k = 0; k < count; ++k) {
    if (!(line.gaps[k] > tolerance)) continue;
    if (stood >= 0 && (k - stood) * step > apart) {
      const int middle = (stood + k) / 2;
      parts.push_back(part_of(line, first, middle + 1));
      first = middle;
    }
    stood = k;
  }
  parts.push_back(parts.empty() ? std::move(line) : part_of(line, first, count));
  for (StraightFibre& part : parts) part.excess = excess_of(part, step);
  return parts;
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
    double best = 0;  // offset of the best line so far, mm
    const auto try_line = [&](double at) {
      if (stop.now()) throw Stopped("straight lines along the fibres were not all measured");
      StraightFibre whole = line_over(ply, feet, mold, held, frame, reach, at);
      for (StraightFibre& line : parted(std::move(whole), feet.mold_tol_mm, step, held.apart))
        if (line.excess > out[k].excess && goes_on(line, frame.along, held)) out[k] = std::move(line), best = at;
    };
    for (int n = -aside; n <= aside; ++n) try_line(n * kApart);
    for (double closer = kApart / 2; closer > kApart / 8; closer /= 2)  // approach the top of a narrow bump
      for (const double side : {best - closer, best + closer}) try_line(side);
  }
  return out;
}

}  // namespace debulk
