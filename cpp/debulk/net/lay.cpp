#include "debulk/net/lay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "debulk/core/error.hpp"
#include "debulk/net/cell.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kLeastCrossing = 10 * kDegree;  // least angle between the two fibres at the centre

void check_start(const Surface& surface, const Vector2d& centre, const FibreAngles& angles, double spacing) {
  std::ostringstream place;
  place << "(" << centre.x() << ", " << centre.y() << ")";
  require(centre.allFinite(), "centre_mm", "two finite numbers", place.str());
  require(std::isfinite(angles[0]) && std::isfinite(angles[1]), "angles_deg", "two finite numbers", "NaN or infinity");
  require(std::isfinite(spacing) && spacing > 0, "spacing_mm", "a positive length in mm", spacing);
  require(surface.sample(centre).gradient.allFinite(), "centre_mm", "a point where the surface has a height and a slope", place.str());
  const Vector3d u = fibre_direction(surface, centre, angles[0]), v = fibre_direction(surface, centre, angles[1]);
  const double crossing = std::atan2(u.cross(v).norm(), std::abs(u.dot(v)));
  std::ostringstream came;
  came << crossing / kDegree << " degrees (angles " << angles[0] / kDegree << " and " << angles[1] / kDegree << ")";
  require(crossing >= kLeastCrossing, "angles_deg", "two fibre directions that cross at 10 degrees or more", came.str());
}

}  // namespace

void LayOptions::check() const {
  require(longest_path > 0, "longest_path", "a positive number of nodes", longest_path);
  require(most_nodes > 0, "most_nodes", "a positive number", most_nodes);
}

FibreRays fibre_rays(const Surface& surface, const Vector2d& centre, const FibreAngles& angles, double step, PathRule rule) {
  const double half_turn = 180 * kDegree;
  const auto ray = [&](double angle) { return FibreRay(surface, centre, angle, step, rule); };
  return {ray(angles[0]), ray(angles[0] + half_turn), ray(angles[1]), ray(angles[1] + half_turn)};
}

NetLayer::NetLayer(const Surface& surface, FibreRays& rays, const FibreAngles& angles, double spacing, const NetDomain& region,
                   const LayOptions& options)
    : surface_(surface),
      region_(region),
      options_(options),
      turn_(std::sin(angles[1] - angles[0])),
      angles_(angles),
      paths_{RayNodes(rays[east], spacing, region), RayNodes(rays[west], spacing, region), RayNodes(rays[north], spacing, region),
             RayNodes(rays[south], spacing, region)} {
  options.check();
  check_start(surface, rays[east].at(0).xy, angles, spacing);
  if (options.paths == PathRule::least_shear) cells_.emplace(surface, rays[east].at(0).xy, angles, spacing, region);
  lattice_.spacing = spacing;
  lattice_.nodes.push_back(rays[east].at(0).position());
  states_.push_back(State::laid);
}

// Extends the lattice to hold (i, j), each time at least to twice its size.
void NetLayer::make_room(int i, int j) {
  if (within(i, j)) return;
  Lattice wider = lattice_;
  const int columns = lattice_.columns(), rows = lattice_.rows();
  if (i < wider.west) wider.west = std::min(i, wider.west - columns);
  if (i > wider.east) wider.east = std::max(i, wider.east + columns);
  if (j < wider.south) wider.south = std::min(j, wider.south - rows);
  if (j > wider.north) wider.north = std::max(j, wider.north + rows);
  check_size(0.25 * wider.columns() * wider.rows());
  wider.nodes.assign(static_cast<std::size_t>(wider.columns()) * static_cast<std::size_t>(wider.rows()),
                     Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  std::vector<State> states(wider.nodes.size(), State::unknown);
  for (int b = lattice_.south; b <= lattice_.north; ++b)
    for (int a = lattice_.west; a <= lattice_.east; ++a) {
      wider.nodes[wider.index(a, b)] = lattice_.at(a, b);
      states[wider.index(a, b)] = states_[lattice_.index(a, b)];
    }
  lattice_ = std::move(wider);
  states_ = std::move(states);
}

const Vector3d* NetLayer::on_path(int i, int j) {
  const auto number = static_cast<std::size_t>(std::max(std::abs(i), std::abs(j)));
  constexpr std::size_t long_enough = 1000;  // to tell that a path is trapped before the net around it is laid, too
  if (static_cast<long>(number) >= options_.longest_path || (number % long_enough == 0 && trapped())) refuse_size();
  if (cells_) return cells_->node(i, j);
  return paths_[j == 0 ? (i > 0 ? east : west) : (j > 0 ? north : south)].node(number);
}

// Lays a node whose state is unknown; the nodes that it needs have been laid.
void NetLayer::lay(int i, int j) {
  const bool along_fibre = begins(i, j);  // a node on an initial path takes a hundred times as long
  if ((along_fibre || ++laid_ % 64 == 0) && options_.stop.now()) throw Stopped("the laying of a net was stopped");
  State& state = states_[lattice_.index(i, j)];
  state = State::none;
  const auto keep = [&](const Vector3d& node) {
    lattice_.nodes[lattice_.index(i, j)] = node;
    state = State::laid;
  };
  if (along_fibre) {
    if (const Vector3d* node = on_path(i, j)) keep(*node);
    return;
  }
  const int si = i > 0 ? 1 : -1, sj = j > 0 ? 1 : -1;
  const Vector3d &common = lattice_.at(i - si, j - sj), &a = lattice_.at(i, j - sj), &b = lattice_.at(i - si, j);
  const std::optional<Vector3d> found = fourth_node(surface_, common, a, b, lattice_.spacing);
  if (!found || !region_(found->head<2>())) return;
  if (!folds_over(common, a, b, *found, turn_ * si * sj)) keep(*found);
}

const Vector3d* NetLayer::at(int i, int j) {
  make_room(i, j);
  if (state(i, j) == State::unknown) asked_.push_back({i, j});
  while (!asked_.empty()) {
    const auto [a, b] = asked_.back();
    const int si = (a > 0) - (a < 0), sj = (b > 0) - (b < 0);
    const std::array<std::array<int, 2>, 3> needed{{{a - si, b - sj}, {a, b - sj}, {a - si, b}}};
    bool misses = false, waits = false;
    if (!begins(a, b)) {
      for (const auto& [p, q] : needed) misses = misses || state(p, q) == State::none;
      for (const auto& [p, q] : needed)
        if (!misses && state(p, q) == State::unknown) {
          asked_.push_back({p, q});
          waits = true;
        }
    }
    if (waits) continue;
    asked_.pop_back();
    if (misses)
      states_[lattice_.index(a, b)] = State::none;
    else if (state(a, b) == State::unknown)
      lay(a, b);
  }
  return state(i, j) == State::laid ? &lattice_.at(i, j) : nullptr;
}

void NetLayer::check_size(double nodes) const {
  if (!(nodes <= static_cast<double>(options_.most_nodes))) refuse_size();
}

// Returns what stops a path that runs up or down so steep a part of the surface that it hardly leaves it, if most
// segments of a path do; else nothing.
std::optional<std::string> NetLayer::trapped() const {
  constexpr double steep = 85 * kDegree;
  constexpr int few = 400;  // segments; a path with no more on slopes may be short, and others carry the net
  int most = few;
  std::ostringstream out;
  for (const Direction way : {east, west, north, south}) {
    const int di = (way == east) - (way == west), dj = (way == north) - (way == south);
    int laid = 0, on_slope = 0;
    Vector3d begin = lattice_.at(0, 0), last = begin;
    double steepest = 0;
    for (; state((laid + 1) * di, (laid + 1) * dj) == State::laid; ++laid) {
      const Vector3d& here = lattice_.at((laid + 1) * di, (laid + 1) * dj);
      const double slope = std::atan2(std::abs(here.z() - last.z()), (here - last).head<2>().norm());
      if (slope >= steep && on_slope++ == 0) begin = last;
      steepest = std::max(steepest, slope);
      last = here;
    }
    if (on_slope <= std::max(most, laid / 2)) continue;
    most = on_slope;
    out.str("");
    out << "a path that is trapped: the fibre at " << angles_[dj == 0 ? 0 : 1] / kDegree << " degrees comes at (" << begin.x() << ", "
        << begin.y() << ") to a slope of up to " << steepest / kDegree << " degrees, on which its next " << on_slope << " segments of "
        << lattice_.spacing << " mm advance by only " << (last - begin).head<2>().norm() << " mm seen from above";
  }
  return most > few ? std::optional(out.str()) : std::nullopt;
}

void NetLayer::refuse_size() const {
  const std::optional<std::string> came = trapped();
  require(came.has_value(), "spacing_mm", "a spacing that needs fewer nodes in this region", lattice_.spacing);
  const char* way_out = options_.paths == PathRule::vertical_plane ? "in a vertical plane none can turn away from a slope: choose "
                                                                     "\"geodesic\" or \"least_shear\""
                                                                   : "choose another rule";
  throw InputError(std::string("paths: expected paths that cross the region (") + way_out +
                   ", another start or directions, or an outline that ends before the slope), but got " + *came);
}

Lattice NetLayer::lattice() const {
  Lattice out;
  out.spacing = lattice_.spacing;
  for (int j = lattice_.south; j <= lattice_.north; ++j)
    for (int i = lattice_.west; i <= lattice_.east; ++i)
      if (state(i, j) == State::laid) {
        out.west = std::min(out.west, i), out.east = std::max(out.east, i);
        out.south = std::min(out.south, j), out.north = std::max(out.north, j);
      }
  check_size(static_cast<double>(out.columns()) * out.rows());
  out.nodes.reserve(static_cast<std::size_t>(out.columns()) * static_cast<std::size_t>(out.rows()));
  for (int j = out.south; j <= out.north; ++j)
    for (int i = out.west; i <= out.east; ++i) out.nodes.push_back(lattice_.at(i, j));
  return out;
}

NetDomain fibre_parallelogram(const std::vector<Vector2d>& outline, const Vector2d& centre, const FibreAngles& angles, double margin) {
  Eigen::Matrix2d along;
  along << std::cos(angles[0]), std::cos(angles[1]), std::sin(angles[0]), std::sin(angles[1]);
  const Eigen::Matrix2d to_fibres = along.inverse();
  Vector2d low = Vector2d::Zero(), high = Vector2d::Zero();  // the centre belongs to the parallelogram
  for (const Vector2d& p : outline) {
    const Vector2d q = to_fibres * (p - centre);
    low = low.cwiseMin(q);
    high = high.cwiseMax(q);
  }
  const double skew = margin / std::abs(along.determinant());
  const Vector2d widening = 0.25 * (high - low) + Vector2d(skew, skew);
  low -= widening;
  high += widening;
  return [=](const Vector2d& p) {
    const Vector2d q = to_fibres * (p - centre);
    return (q.array() >= low.array()).all() && (q.array() <= high.array()).all();
  };
}

}  // namespace debulk
