#include "debulk/section/start.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Returns the point of a line at the running length `at`.
Eigen::Vector2d point_at(const Eigen::Matrix2Xd& line, const Eigen::VectorXd& running, double at) {
  const double* after = std::upper_bound(running.data() + 1, running.data() + running.size() - 1, at);
  const long i = after - running.data() - 1;
  return line.col(i) + (at - running[i]) / (running[i + 1] - running[i]) * (line.col(i + 1) - line.col(i));
}

// Returns half a bump from its crown as (distance, height) of `count` + 1 nodes. The slope angle at the arc length a is
// steepest sin(pi a / arc), as in the buckling of a beam; `steepest` is such that the half bump is `excess` shorter
// than its arc.
Eigen::Matrix2Xd half_bump(int count, double length, double excess) {
  const auto angle = [&](int k, double steepest) { return steepest * std::sin(kPi * (k + 0.5) / count); };
  double low = 0, high = 2.4;
  for (int bisection = 0; bisection < 60; ++bisection) {
    const double steepest = (low + high) / 2;
    double shortening = 0;
    for (int k = 0; k < count; ++k) shortening += length * (1 - std::cos(angle(k, steepest)));
    (shortening < excess ? low : high) = steepest;
  }
  Eigen::Matrix2Xd out = Eigen::Matrix2Xd::Zero(2, count + 1);
  for (int k = 0; k < count; ++k) out.col(k + 1) = out.col(k) + length * Eigen::Vector2d(std::cos(angle(k, low)), -std::sin(angle(k, low)));
  out.row(1).array() -= out(1, count);
  return out;
}

}  // namespace

SectionStart section_start(const SectionProfile& mold, double half_span, double excess, int segments, double bump) {
  const int half = segments / 2;
  SectionStart out{Eigen::VectorXd(segments), Eigen::Matrix2Xd::Zero(2, segments + 1)};
  for (const int side : {-1, 1}) {
    const Eigen::Matrix2Xd below = mold.line(0, side * half_span, 4 * half);
    const Eigen::VectorXd running = running_length(below);
    const double length = (running[running.size() - 1] + excess / 2) / half;
    out.lengths.segment(side < 0 ? 0 : half, half).setConstant(length);
    const int count = std::clamp(static_cast<int>(std::ceil(std::max(bump / 2, excess) / length)), 1, half);
    const Eigen::Matrix2Xd raised = half_bump(count, length, excess / 2);
    for (int k = 1; k <= half; ++k) {
      const bool on_bump = k < count;
      const Eigen::Vector2d foot = point_at(below, running, on_bump ? raised(0, k) : k * length - excess / 2);
      out.line.col(half + side * k) = foot + Eigen::Vector2d(0, on_bump ? raised(1, k) : 0.0);
    }
    out.line(1, half) += raised(1, 0) / 2;  // the two sides' crown heights differ a little on a mold that is not symmetric
  }
  out.line(1, half) += mold.at(0).height;
  return out;
}

}  // namespace debulk
