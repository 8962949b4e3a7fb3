#include "debulk/ridge/bridge_section.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "debulk/pocket/foot_heights.hpp"
#include "debulk/pocket/outline_search.hpp"
#include "debulk/ridge/taut_string.hpp"

namespace debulk {
namespace {

constexpr double kApart = 4.0;      // mm, from line to line
constexpr double kStep = 1.0;       // mm, along a line
constexpr double kAround = 40.0;    // mm of laid ply beyond each end, over which the string may come off the mold as well
constexpr double kLaid = 0.03;      // mm; ply lower than this lies on the mold
constexpr double kTail = 20.0;      // mm beyond the foot within which the ply comes down from the mold tolerance
constexpr double kEnds = 10.0;      // mm, uncertainty of the place where the ply comes down and friction begins to hold
constexpr double kStraight = 1e5;   // mm, radius of a string that is practically straight
constexpr double kWavelength = 20;  // mm, length over which errors of smoothed heights are alike (docs/verdicts.md)
constexpr int kBend = 4;            // steps to either side over which the ply's curvature is computed: the filters' window
constexpr int kEnough = 30;         // number of heights of laid ply that suffices to estimate their scatter

// One line, from kAround before the ply comes off the mold to kAround after it has come down, or to the edge of the
// known mold or of the ply.
struct Line {
  MoldSection mold;
  double lacks = 0;   // mm, by which the ply is shorter than the mold
  double bends = 0;   // 1/mm, integral of the ply's squared curvature
  double radius = 0;  // mm, largest radius of an arc that friction holds
};

Polygon corners(const Box& box) {
  return {box.low, {box.high.x(), box.low.y()}, box.high, {box.low.x(), box.high.y()}};
}

class Lines {
 public:
  Lines(const FootMap& feet, const Foot& foot, const Surface& mold, const BridgeSectionOptions& options)
      : ply_(feet, foot),
        feet_(feet),
        mold_(mold),
        options_(options),
        outline_(options.ply.empty() ? corners(options.mold_known) : options.ply) {}

  // Measures one line; returns false if the mold below it is not known.
  bool measure(const Eigen::Vector2d& origin, const Eigen::Vector2d& along, int reach) {
    const auto at = [&](int k) -> Eigen::Vector2d { return origin + k * kStep * along; };
    int first = -reach, last = reach;
    while (first <= last && !ply_.on_foot(at(first))) ++first;
    while (last >= first && !ply_.on_foot(at(last))) --last;
    if (first > last) return true;
    std::vector<double> gaps = between(at, first, last);
    const std::vector<double> before = tail(at, first, -1, gaps.front()), after = tail(at, last, 1, gaps.back());
    gaps.insert(gaps.begin(), before.rbegin(), before.rend());
    gaps.insert(gaps.end(), after.begin(), after.end());
    first -= static_cast<int>(before.size());
    last += static_cast<int>(after.size());
    if (!known(at(first)) || !known(at(last))) return false;

    const double way_back = outline_.way_out(at(first), -along), way_on = outline_.way_out(at(last), along);
    const int lead = laid_beyond(at, first, -1, way_back), trail = laid_beyond(at, last, 1, way_on);
    Line line;
    line.mold.step = kStep;
    line.radius = options_.friction * std::min(way_back, way_on);
    for (int k = first - lead; k <= last + trail; ++k) line.mold.heights.push_back(mold_.height(at(k)));
    gaps.insert(gaps.begin(), static_cast<std::size_t>(lead), 0.0);
    gaps.insert(gaps.end(), static_cast<std::size_t>(trail), 0.0);
    line.lacks = lacking(line.mold.heights, gaps);
    line.bends = bends(line.mold.heights, gaps);
    if (line.lacks > 0) lines.push_back(std::move(line));
    return true;
  }

  // Returns the root mean square of the heights of the ply that lies on the mold round the pocket; the mold tolerance
  // if there are too few.
  double scatter() const { return laid_ < kEnough ? feet_.mold_tol_mm : std::sqrt(squares_ / laid_); }

  std::vector<Line> lines;  // the lines that are too short

 private:
  template <class At>
  std::vector<double> between(const At& at, int first, int last) const {
    std::vector<double> gaps;
    for (int k = first; k <= last; ++k) {
      const double gap = lower_side(at(k));
      // A height that is not known repeats the one before: a step down to the mold and up again would add length that
      // the ply does not have.
      gaps.push_back(std::isnan(gap) ? (gaps.empty() ? 0.0 : gaps.back()) : std::max(gap, 0.0));
    }
    return gaps;
  }

  // Returns the heights from the foot outwards, until the ply lies on the mold or rises again.
  template <class At>
  std::vector<double> tail(const At& at, int end, int on, double gap) const {
    std::vector<double> out;
    while (out.size() * kStep < kTail) {
      const double next = lower_side(at(end + on * (static_cast<int>(out.size()) + 1)));
      if (!(next > kLaid && next <= gap + kLaid)) break;
      out.push_back(gap = next);
    }
    return out;
  }

  // Returns the number of steps beyond an end, up to the edge, over which the ply is taken to lie on the mold. Their
  // heights serve to estimate the scatter.
  template <class At>
  int laid_beyond(const At& at, int end, int on, double way) {
    int count = 0;
    while ((count + 1) * kStep <= std::min(kAround, way) && known(at(end + on * (count + 1)))) {
      ++count;
      const double height = lower_side(at(end + on * count));
      if (!(std::abs(height) <= feet_.mold_tol_mm)) continue;  // part of another pocket, or not known
      squares_ += height * height;
      ++laid_;
    }
    return count;
  }

  double lower_side(const Eigen::Vector2d& xy) const { return ply_.anywhere(xy) - feet_.options.thickness_mm; }

  bool known(const Eigen::Vector2d& xy) const {
    return (xy.array() >= options_.mold_known.low.array()).all() && (xy.array() <= options_.mold_known.high.array()).all();
  }

  static double lacking(const std::vector<double>& mold, const std::vector<double>& gaps) {
    double out = 0;
    for (std::size_t k = 1; k < mold.size(); ++k) {
      const double rise = mold[k] - mold[k - 1];
      out += std::hypot(kStep, rise) - std::hypot(kStep, rise + gaps[k] - gaps[k - 1]);
    }
    return out;
  }

  static double bends(const std::vector<double>& mold, const std::vector<double>& gaps) {
    double out = 0;
    const auto ply = [&](std::size_t k) { return mold[k] + gaps[k]; };
    for (std::size_t k = kBend; k + kBend < mold.size(); ++k)
      if (gaps[k] > 0) out += std::pow((ply(k + kBend) - 2 * ply(k) + ply(k - kBend)) / (kBend * kStep * kBend * kStep), 2) * kStep;
    return out;
  }

  FootHeights ply_;
  const FootMap& feet_;
  const Surface& mold_;
  const BridgeSectionOptions& options_;
  OutlineSearch outline_;
  double squares_ = 0;
  long laid_ = 0;
};

}  // namespace

// A height error d where the ply turns by an angle a makes it longer by a d. Errors that are alike over a wavelength
// add up to sqrt(wavelength * integral of squared curvature) times a single error. The standard deviation of the errors
// is estimated where the ply lies on the mold.
std::optional<BridgeSection> bridge_section(const FootMap& feet, const Foot& foot, const Surface& mold, const FibreAngles& angles,
                                            const BridgeSectionOptions& options, const Stop& stop) {
  if (foot.outline.empty()) return std::nullopt;
  const Box box = bounding_box(foot.outline);
  const double half = 0.5 * (box.high - box.low).norm();
  const int reach = static_cast<int>(half / kStep) + 1, aside = static_cast<int>(half / kApart) + 1;
  Lines all(feet, foot, mold, options);
  for (const double angle : angles) {
    const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
    for (int n = -aside; n <= aside; ++n) {
      if (stop.now()) throw Stopped("the sections of the fibres over a pocket were not all measured");
      if (!all.measure(0.5 * (box.low + box.high) + n * kApart * across, along, reach)) return std::nullopt;
    }
  }
  BridgeSection out;
  const Line* chosen = nullptr;
  for (const Line& line : all.lines) {
    if (stop.now()) throw Stopped("the sections of the fibres over a pocket were not all weighed");
    const double error = std::max(options.least_error, 2 * all.scatter() * std::sqrt(kWavelength * line.bends));
    const double ends = options.friction * kEnds;
    const auto gap = [&line](double lacks, double more) { return taut_string_lacking(line.mold, lacks, line.radius + more).gap; };
    // The gap grows with the missing length, so no gap is higher than that of the straightest string that friction
    // holds.
    const double highest = gap(kStraight, 0);
    if (chosen != nullptr && highest <= out.least_gap && (highest > 0 || line.lacks <= out.lacks)) continue;
    const double least = gap(line.lacks - error, -ends), nominal = gap(line.lacks, 0);
    if (chosen != nullptr && std::tie(least, nominal, line.lacks) <= std::tie(out.least_gap, out.gap, out.lacks)) continue;
    chosen = &line;
    out = {nominal, least, gap(line.lacks + error, ends), line.lacks, error, 0.0, options.pressure * line.radius};
  }
  if (chosen != nullptr) out.pull = options.pressure * taut_string_lacking(chosen->mold, chosen->lacks, kStraight).radius;
  return out;
}

}  // namespace debulk
