#include "debulk/net/lay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "debulk/core/error.hpp"
#include "debulk/net/bracketed_root.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr double kLeastCrossing = 10 * kDegree;  // least angle between the two fibres at the centre
constexpr double kLeastOpening = 2 * kDegree;    // of a cell: one that is closer to closing is locked

double cross(const Vector3d& u, const Vector3d& v) {
  return u.x() * v.y() - u.y() * v.x();
}

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

std::optional<Vector3d> fourth_node(const Surface& surface, const Vector3d& common, const Vector3d& a, const Vector3d& b, double spacing) {
  // The points at distance `spacing` from both a and b lie on a circle about the chord's middle, and `common` is one of
  // them. Let phi be the angle on the circle, upwards positive, from the point opposite to `common`, which would
  // complete a parallelogram. We look for the point nearest to phi = 0 where the circle meets the surface. This has one
  // unknown instead of (x, y), and the lengths are exact by construction.
  const Vector3d chord = b - a;
  const double opening = 2 * std::asin(std::min(1.0, chord.norm() / (2 * spacing)));
  if (!(opening >= kLeastOpening && opening <= 180 * kDegree - kLeastOpening)) return std::nullopt;
  const Vector3d middle = 0.5 * (a + b), along = chord.normalized();
  const double radius = spacing * std::cos(opening / 2);
  const Vector3d away = middle - common;
  const Vector3d out = (away - away.dot(along) * along).normalized();
  Vector3d up = along.cross(out);
  if (up.z() < 0) up = -up;
  const auto on_circle = [&](double phi) -> Vector3d { return middle + radius * (std::cos(phi) * out + std::sin(phi) * up); };
  struct {
    double phi, height;
    Vector3d point;
  } last;  // the point at which the gap was last evaluated
  const auto gap = [&](double phi) {
    const Vector3d p = on_circle(phi);
    last = {phi, surface.height(p.head<2>()), p};
    return p.z() - last.height;
  };

  constexpr double march = 0.1;     // rad
  constexpr double farthest = 2.6;  // rad; `common` itself is at pi
  double phi = 0, value = gap(0);
  const double direction = value > 0 ? -march : march;
  double next = 0, next_value = value;
  while (std::isfinite(next_value) && next_value != 0 && (next_value > 0) == (value > 0)) {
    phi = next;
    value = next_value;
    next = phi + direction;
    if (std::abs(next) > farthest) return std::nullopt;
    next_value = gap(next);
  }
  if (!std::isfinite(next_value)) return std::nullopt;
  const double root = next == phi ? phi : bracketed_root(gap, phi, value, next, next_value, 1e-14 * spacing);
  if (root != last.phi) gap(root);
  return Vector3d(last.point.x(), last.point.y(), last.height);
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
      paths_{RayNodes(rays[east], spacing, region), RayNodes(rays[west], spacing, region), RayNodes(rays[north], spacing, region),
             RayNodes(rays[south], spacing, region)} {
  options.check();
  check_start(surface, rays[east].at(0).xy, angles, spacing);
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
  require(static_cast<long>(wider.columns()) * wider.rows() <= 4 * options_.most_nodes, "spacing_mm",
          "a spacing that needs fewer nodes in this region", lattice_.spacing);
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
  const auto number = static_cast<std::size_t>(std::abs(i + j));
  require(static_cast<long>(number) < options_.longest_path, "spacing_mm", "a spacing that needs fewer nodes in this region",
          lattice_.spacing);
  return paths_[j == 0 ? (i > 0 ? east : west) : (j > 0 ? north : south)].node(number);
}

// Lays a node whose state is unknown; the nodes that it needs have been laid.
void NetLayer::lay(int i, int j) {
  const bool along_fibre = i == 0 || j == 0;  // a node on an initial path takes a hundred times as long
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
  const double side = turn_ * si * sj;
  const bool folded = cross(a - common, b - common) * side <= 0 || cross(*found - b, *found - a) * side <= 0;
  if (!folded) keep(*found);
}

const Vector3d* NetLayer::at(int i, int j) {
  make_room(i, j);
  if (state(i, j) == State::unknown) asked_.push_back({i, j});
  while (!asked_.empty()) {
    const auto [a, b] = asked_.back();
    const int si = (a > 0) - (a < 0), sj = (b > 0) - (b < 0);
    const std::array<std::array<int, 2>, 3> needed{{{a - si, b - sj}, {a, b - sj}, {a - si, b}}};
    bool misses = false, waits = false;
    if (si != 0 && sj != 0) {
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

Lattice NetLayer::lattice() const {
  Lattice out;
  out.spacing = lattice_.spacing;
  for (int j = lattice_.south; j <= lattice_.north; ++j)
    for (int i = lattice_.west; i <= lattice_.east; ++i)
      if (state(i, j) == State::laid) {
        out.west = std::min(out.west, i), out.east = std::max(out.east, i);
        out.south = std::min(out.south, j), out.north = std::max(out.north, j);
      }
  require(static_cast<long>(out.columns()) * out.rows() <= options_.most_nodes, "spacing_mm",
          "a spacing that needs fewer nodes in this region", out.spacing);
  out.nodes.reserve(static_cast<std::size_t>(out.columns()) * static_cast<std::size_t>(out.rows()));
  for (int j = out.south; j <= out.north; ++j)
    for (int i = out.west; i <= out.east; ++i) out.nodes.push_back(lattice_.at(i, j));
  return out;
}

Lattice lay_net(const Surface& surface, const Vector2d& centre, const FibreAngles& angles, double spacing, const NetDomain& region,
                const LayOptions& options) {
  options.check();
  check_start(surface, centre, angles, spacing);
  FibreRays rays = fibre_rays(surface, centre, angles, spacing / kStepsPerSegment, options.paths);
  NetLayer layer(surface, rays, angles, spacing, region, options);
  const auto path = [&](int di, int dj) {
    int n = 0;
    while (layer.at((n + 1) * di, (n + 1) * dj) != nullptr) ++n;
    return n;
  };
  const int n_east = path(1, 0), n_west = path(-1, 0), n_north = path(0, 1), n_south = path(0, -1);
  require(static_cast<long>(n_west + 1 + n_east) * (n_south + 1 + n_north) <= options.most_nodes, "spacing_mm",
          "a spacing that needs fewer nodes in this region", spacing);
  for (int j = -n_south; j <= n_north; ++j)
    for (int i = -n_west; i <= n_east; ++i) layer.at(i, j);
  return layer.lattice();
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
