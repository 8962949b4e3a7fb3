#include "debulk/section/frame.hpp"

#include <sstream>
#include <string>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

void check_profile(const std::vector<Eigen::Vector2d>& profile, double span) {
  require(profile.size() >= 2, "profile", "two or more points", profile.size());
  for (std::size_t i = 0; i < profile.size(); ++i) {
    require(profile[i].allFinite(), "profile", "finite coordinates", "a missing value at point " + std::to_string(i));
    require(i == 0 || profile[i].x() > profile[i - 1].x(), "profile", "x to grow from point to point",
            "a step back to point " + std::to_string(i));
  }
  std::ostringstream reach;
  reach << "x from " << profile.front().x() << " to " << profile.back().x() << " for a span of " << span << " mm";
  const double margin = 1e-9 * span;
  require(profile.front().x() <= -span / 2 + margin && profile.back().x() >= span / 2 - margin, "profile",
          "points from -span_mm / 2 to span_mm / 2 or farther", reach.str());
}

}  // namespace

SectionFrame section_frame(double span, double unit, const std::vector<Eigen::Vector2d>& profile) {
  SectionFrame frame;
  frame.unit = unit;
  frame.half_span = span / 2 / unit;
  if (profile.empty()) return frame;
  check_profile(profile, span);
  const SectionProfile mold(profile);
  const Eigen::Vector2d left(-span / 2, mold.at(-span / 2).height), right(span / 2, mold.at(span / 2).height);
  frame.origin = (left + right) / 2;
  frame.along = (right - left).normalized();
  frame.half_span = (right - left).norm() / 2 / unit;
  return frame;
}

SectionProfile section_mold(const SectionFrame& frame, const std::vector<Eigen::Vector2d>& profile) {
  std::vector<Eigen::Vector2d> points;
  for (const Eigen::Vector2d& point : profile) {
    points.push_back(frame.into(point));
    require(points.size() < 2 || points.back().x() > points[points.size() - 2].x(), "profile",
            "a mold that does not overhang the line between the pins", "a step back to point " + std::to_string(points.size() - 1));
  }
  return points.empty() ? SectionProfile() : SectionProfile(std::move(points));
}

}  // namespace debulk
