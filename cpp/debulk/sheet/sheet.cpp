#include "debulk/sheet/sheet.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "debulk/core/error.hpp"
#include "debulk/sheet/bending.hpp"
#include "debulk/sheet/friction.hpp"
#include "debulk/sheet/in_plane_bending.hpp"
#include "debulk/sheet/load.hpp"
#include "debulk/sheet/normal_pressure.hpp"
#include "debulk/sheet/shear.hpp"
#include "debulk/sheet/tack.hpp"
#include "debulk/sheet/torsion.hpp"
#include "debulk/surface/moved.hpp"

namespace debulk {
namespace {

constexpr double kElasticShare = 0.01;  // share of the largest spring force at the start that sets the unit of force, if it is larger
constexpr std::array<const char*, 5> kPaperTerms = {"bending", "shear", "friction", "gravity", "vacuum"};

std::vector<int> nodes_of_kind(const std::vector<NodeKind>& kinds, bool (*wanted)(NodeKind)) {
  std::vector<int> out;
  for (std::size_t i = 0; i < kinds.size(); ++i)
    if (wanted(kinds[i])) out.push_back(static_cast<int>(i));
  return out;
}

std::vector<double> scaled(double factor, std::vector<double> values) {
  for (double& value : values) value *= factor;
  return values;
}

}  // namespace

Sheet::Sheet(Net net, double area_mm2, const PlyMaterial& ply, std::shared_ptr<const Surface> mold)
    : net_(std::move(net)), area_(area_mm2), ply_(ply), mold_(std::move(mold)) {
  check_net();
  ply_.check();
  require(std::isfinite(area_mm2) && area_mm2 > 0, "area_mm2", "a positive area in mm2", area_mm2);
  require(mold_ != nullptr, "reference", "a surface", "none");

  const std::vector<double> areas = nodal_areas(net_, ply_.lumping, area_mm2);
  const double weight_mpa = ply_.thickness_mm * ply_.density_kg_m3 * 1e-9 * ply_.gravity_m_s2;
  const double largest_mm2 = *std::max_element(areas.begin(), areas.end());
  nodal_force_ = ply_.pressure_mpa * largest_mm2;
  loads_ = scaled(ply_.pressure_mpa + weight_mpa, areas);
  segments_ = debulk::segments(net_.neighbours);
  movable_ = nodes_of_kind(net_.kinds, [](NodeKind kind) { return kind != NodeKind::fixed; });
  const std::vector<int> free = nodes_of_kind(net_.kinds, [](NodeKind kind) { return kind == NodeKind::free; });

  add_term<Bending>("bending", ply_.bending_mj(), ply_.bending_mj(), net_.neighbours);
  add_term<Shear>("shear", ply_.shear_mpa, ply_.shear_mpa, net_.spacing, ply_.thickness_mm, net_.neighbours);
  const std::vector<double> grips = scaled(ply_.friction * ply_.pressure_mpa, gripping_areas(net_, free, ply_.lumping, area_mm2));
  grip_ = std::accumulate(grips.begin(), grips.end(), 0.0);
  add_term<Friction>("friction", grip_, grips, net_.spacing, free, net_.nodes);
  add_term<Load>("gravity", weight_mpa, scaled(weight_mpa, areas), net_.nodes);
  if (ply_.pressure_direction == PressureDirection::vertical)
    add_term<Load>("vacuum", nodal_force_, scaled(ply_.pressure_mpa, areas), net_.nodes);
  else
    add_term<NormalPressure>("vacuum", nodal_force_, ply_.pressure_mpa, net_.neighbours, net_.nodes);
  add_term<Torsion>("torsion", ply_.torsion_n_mm, ply_.torsion_n_mm, net_.neighbours);
  add_term<InPlaneBending>("in_plane_bending", ply_.in_plane_bending_n_mm, ply_.in_plane_bending_n_mm, net_.neighbours);
  const std::vector<int> sticking = ply_.tack_n_mm3 > 0 ? sticking_nodes() : std::vector<int>();
  std::vector<double> held_areas;
  for (const int node : sticking) held_areas.push_back(areas[static_cast<std::size_t>(node)]);
  const double held_mm2 = std::accumulate(held_areas.begin(), held_areas.end(), 0.0);
  add_term<Tack>("tack", ply_.tack_n_mm3 * held_mm2, ply_.tack_n_mm3, held_areas, sticking, mold_);

  strict_force_ = std::max(nodal_force_, weight_mpa * largest_mm2);
  double spring = 0;
  for (const NamedTerm& t : terms_) spring = std::max(spring, t.term->largest_force(net_.nodes));
  force_unit_ = std::max(strict_force_, kElasticShare * spring);
  if (force_unit_ <= 0) force_unit_ = 1;
  if (strict_force_ <= 0) strict_force_ = force_unit_;

  std::vector<char> held(net_.nodes.size());
  for (std::size_t i = 0; i < held.size(); ++i) held[i] = net_.kinds[i] == NodeKind::fixed;
  movable_hessian_ = BlockMatrix(static_cast<int>(net_.nodes.size()), groups(), held);
  for (NamedTerm& t : terms_) t.places = t.term->places(movable_hessian_);
}

double Sheet::size_mm() const {
  Eigen::Vector3d low = net_.nodes.front(), high = low;
  for (const Eigen::Vector3d& p : net_.nodes) low = low.cwiseMin(p), high = high.cwiseMax(p);
  return (high - low).norm();
}

Sheet Sheet::moved(const Eigen::Vector3d& by) const {
  Net net = net_;
  for (Eigen::Vector3d& node : net.nodes) node += by;
  return Sheet(std::move(net), area_, ply_, debulk::moved(mold_, by));
}

std::vector<std::array<int, 3>> Sheet::groups() const {
  std::vector<std::array<int, 3>> out;
  for (const auto& [i, j] : segments_) out.push_back({i, j, j});
  for (const NamedTerm& t : terms_)
    for (const auto& group : t.term->groups()) out.push_back(group);
  return out;
}

template <class T, class... Parts>
void Sheet::add_term(const std::string& name, double strength, Parts&&... parts) {
  if (strength > 0)
    terms_.push_back({name, std::make_shared<const T>(std::forward<Parts>(parts)...), {}});
  else
    left_out_.push_back(name);
}

std::vector<int> Sheet::sticking_nodes() const {
  std::vector<int> out;
  for (const int node : movable_) {
    const Eigen::Vector3d& at = net_.nodes[static_cast<std::size_t>(node)];
    if (at.z() - mold_->height(at.head<2>()) <= Tack::kReach_mm) out.push_back(node);
  }
  return out;
}

void Sheet::check_net() const {
  const int count = static_cast<int>(net_.nodes.size());
  require(count >= 2, "nodes_mm", "at least 2 nodes", count);
  require(net_.neighbours.size() == net_.nodes.size(), "neighbours", "one row per node", net_.neighbours.size());
  require(net_.kinds.size() == net_.nodes.size(), "kinds", "one per node", net_.kinds.size());
  require(std::isfinite(net_.spacing) && net_.spacing > 0, "spacing_mm", "a positive length in mm", net_.spacing);
  check_points(net_.nodes);
  require(net_.to_edge.empty() || net_.to_edge.size() == net_.nodes.size(), "edge_mm", "one way per node", net_.to_edge.size());
  for (const double way : net_.to_edge) require(std::isfinite(way) && way >= 0, "edge_mm", "ways of 0 mm or more", way);
  constexpr std::array<Direction, 4> opposite = {west, east, south, north};
  for (int i = 0; i < count; ++i) {
    const auto kind = static_cast<int>(net_.kinds[static_cast<std::size_t>(i)]);
    require(kind <= 2, "kinds", "0 (inner), 1 (fixed) or 2 (free)", kind);
    for (std::size_t d = 0; d < 4; ++d) {
      const int j = net_.neighbours[static_cast<std::size_t>(i)][d];
      if (j == -1) continue;
      require(j >= 0 && j < count && j != i, "neighbours", "numbers of other nodes, or -1", j);
      require(net_.neighbours[static_cast<std::size_t>(j)][opposite[d]] == i, "neighbours",
              "mutual neighbours (whose e is the other's w, whose n is the other's s)",
              "node " + std::to_string(i) + " naming node " + std::to_string(j) + ", which does not name it back");
    }
  }
}

void Sheet::check_points(const Points& x) const {
  require(x.size() == net_.nodes.size(), "nodes_mm", "one point a node", x.size());
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!x[i].allFinite()) require(false, "nodes_mm", "finite coordinates", "node " + std::to_string(i) + " without");
}

double Sheet::energy(const Points& x) const {
  check_points(x);
  double sum = 0;
  for (const NamedTerm& t : terms_) sum += t.term->value(x);
  return sum;
}

std::vector<std::pair<std::string, double>> Sheet::terms(const Points& x) const {
  check_points(x);
  std::vector<std::pair<std::string, double>> out;
  for (const char* name : kPaperTerms) {
    const auto found = std::find_if(terms_.begin(), terms_.end(), [&](const NamedTerm& t) { return t.name == name; });
    const bool load = name == std::string("gravity") || name == std::string("vacuum");
    out.emplace_back(name, found == terms_.end() ? 0.0 : (load ? -1 : 1) * found->term->value(x));
  }
  for (const NamedTerm& t : terms_)
    if (std::find(kPaperTerms.begin(), kPaperTerms.end(), t.name) == kPaperTerms.end()) out.emplace_back(t.name, t.term->value(x));
  return out;
}

double Sheet::add_gradient(const Points& x, Points& gradient) const {
  double sum = 0;
  for (const NamedTerm& t : terms_) sum += t.term->add_gradient(x, gradient);
  return sum;
}

Points Sheet::gradient(const Points& x) const {
  check_points(x);
  Points out(x.size(), Eigen::Vector3d::Zero());
  add_gradient(x, out);
  return out;
}

void Sheet::add_movable_hessian(const Points& x, BlockMatrix& hessian) const {
  for (const NamedTerm& t : terms_) t.term->add_hessian(x, t.places, hessian);
}

BlockMatrix Sheet::hessian(const Points& x) const {
  check_points(x);
  BlockMatrix out(static_cast<int>(x.size()), groups());
  for (const NamedTerm& t : terms_) t.term->add_hessian(x, t.term->places(out), out);
  return out;
}

std::vector<double> Sheet::lengths(const Points& x) const {
  check_points(x);
  std::vector<double> out;
  out.reserve(segments_.size());
  for (const auto& [i, j] : segments_) out.push_back((x[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(j)]).norm());
  return out;
}

std::vector<double> Sheet::gaps(const Points& x) const {
  check_points(x);
  std::vector<double> out;
  out.reserve(x.size());
  for (const Eigen::Vector3d& p : x) out.push_back(p.z() - mold_->height(p.head<2>()));
  return out;
}

}  // namespace debulk
