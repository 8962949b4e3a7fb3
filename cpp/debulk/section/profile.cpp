#include "debulk/section/profile.hpp"

#include <algorithm>
#include <utility>

namespace debulk {

SectionProfile::SectionProfile(std::vector<Eigen::Vector2d> points) : points_(std::move(points)), second_(points_.size(), 0.0) {
  // Solve the tridiagonal system of the second derivatives, with F'' = 0 at both ends.
  const std::size_t n = points_.size();
  std::vector<double> ratio(n, 0.0);
  const auto width = [&](std::size_t i) { return points_[i + 1].x() - points_[i].x(); };
  const auto slope = [&](std::size_t i) { return (points_[i + 1].y() - points_[i].y()) / width(i); };
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double pivot = 2 * (width(i - 1) + width(i)) - width(i - 1) * ratio[i - 1];
    ratio[i] = width(i) / pivot;
    second_[i] = (6 * (slope(i) - slope(i - 1)) - width(i - 1) * second_[i - 1]) / pivot;
  }
  for (std::size_t i = n; i-- > 2;) second_[i - 1] -= ratio[i - 1] * second_[i];
}

SectionProfile::Sample SectionProfile::at(double x) const {
  if (points_.empty()) return {};
  const auto after = std::upper_bound(points_.begin() + 1, points_.end() - 1, x, [](double v, const auto& p) { return v < p.x(); });
  const auto i = static_cast<std::size_t>(after - points_.begin()) - 1;
  const Eigen::Vector2d &a = points_[i], &b = points_[i + 1];
  const double w = b.x() - a.x(), secant = (b.y() - a.y()) / w;
  const double start_slope = secant - w * (2 * second_[i] + second_[i + 1]) / 6, third = (second_[i + 1] - second_[i]) / w;
  if (x < a.x()) return {a.y() + start_slope * (x - a.x()), start_slope, 0.0};
  if (x > b.x()) {
    const double end_slope = secant + w * (second_[i] + 2 * second_[i + 1]) / 6;
    return {b.y() + end_slope * (x - b.x()), end_slope, 0.0};
  }
  const double t = x - a.x();
  return {a.y() + t * (start_slope + t * (second_[i] / 2 + t * third / 6)), start_slope + t * (second_[i] + t * third / 2),
          second_[i] + t * third};
}

Eigen::Matrix2Xd SectionProfile::line(double from, double to, int segments) const {
  Eigen::Matrix2Xd out(2, segments + 1);
  for (int i = 0; i <= segments; ++i) {
    const double x = from + (to - from) * i / segments;
    out.col(i) << x, at(x).height;
  }
  return out;
}

Eigen::VectorXd running_length(const Eigen::Matrix2Xd& line) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(line.cols());
  for (long i = 1; i < line.cols(); ++i) out[i] = out[i - 1] + (line.col(i) - line.col(i - 1)).norm();
  return out;
}

}  // namespace debulk
