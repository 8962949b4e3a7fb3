#include "debulk/ridge/held_excess.hpp"

#include <algorithm>

#include "debulk/ridge/mold_length.hpp"

namespace debulk {
namespace {

// Returns the largest height of the upper convex hull above its points (distance along the chord, height).
double taut_string_gap(const std::vector<Eigen::Vector2d>& profile) {
  std::vector<Eigen::Vector2d> hull;
  const auto below = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
    return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x() >= 0;  // true if b is on or below the line from a to c
  };
  for (const Eigen::Vector2d& p : profile) {
    while (hull.size() > 1 && below(hull[hull.size() - 2], hull.back(), p)) hull.pop_back();
    hull.push_back(p);
  }
  double gap = 0;
  std::size_t k = 1;
  for (const Eigen::Vector2d& p : profile) {
    while (k + 1 < hull.size() && hull[k].x() < p.x()) ++k;
    const Eigen::Vector2d &a = hull[k - 1], &b = hull[k];
    gap = std::max(gap, a.y() + (b.y() - a.y()) * (p.x() - a.x()) / (b.x() - a.x()) - p.y());
  }
  return gap;
}

// Does the same for the mold below a fibre, from one end to the other.
double taut_string_gap(const std::vector<Eigen::Vector3d>& ply, const Surface& mold) {
  const Eigen::Vector2d a = ply.front().head<2>(), b = ply.back().head<2>();
  std::vector<Eigen::Vector2d> profile;
  const int count = 4 * static_cast<int>(ply.size());
  for (int k = 0; k <= count; ++k) {
    const double share = static_cast<double>(k) / count;
    profile.emplace_back(share * (b - a).norm(), mold.height(a + share * (b - a)));
  }
  return (b - a).norm() > 0 ? taut_string_gap(profile) : 0.0;
}

}  // namespace

HeldExcess held_excess(const Net& laid, const Surface& mold) {
  HeldExcess out;
  for (const std::vector<int>& fibre : fibres(laid.neighbours)) {
    if (laid.kinds[fibre.front()] != NodeKind::fixed || laid.kinds[fibre.back()] != NodeKind::fixed) continue;
    std::vector<Eigen::Vector3d> ply;
    for (const int n : fibre) ply.push_back(laid.nodes[n]);
    const double excess = fibre_excess(ply, mold);
    ++out.fibres;
    if (excess < 0) out.bridge_bound = std::max(out.bridge_bound, taut_string_gap(ply, mold));
    out.largest = std::max(out.largest, excess);
  }
  return out;
}

}  // namespace debulk
