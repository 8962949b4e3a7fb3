#include "debulk/net/fibre_net.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/net/area.hpp"
#include "debulk/net/edge_ways.hpp"
#include "debulk/net/spread.hpp"
#include "debulk/pocket/outline_search.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;

Polygon outline_with_area(const Polygon& corners, const char* argument) {
  Polygon polygon = checked_polygon(corners, argument);
  const double perimeter = polygon_perimeter(polygon);
  std::ostringstream came;
  came << polygon_area(polygon) << " mm2 in a perimeter of " << perimeter << " mm";
  require(polygon_area(polygon) > 1e-9 * perimeter * perimeter, argument, "a polygon with an area", came.str());
  return polygon;
}

bool lies_on(const Surface& mold, const Eigen::Vector3d& node, double tol) {
  return std::abs(node.z() - mold.height(node.head<2>())) <= tol;
}

// The trimming's record of one lattice place.
struct Place {
  bool kept = false;
  bool past_edge = false;  // outside the ply
  bool inside = false;     // inside the perimeter
};

// The record of the place (i, j).
struct Found {
  int i, j;
  Place place;
};

// Lays and trims one pocket's net at any spacing.
class PocketMesher {
 public:
  // spacing: an estimate of the spacings at which nets will be laid.
  PocketMesher(const Surface& ply, const Surface& mold, const PocketShape& shape, const FibreNetOptions& options, double spacing)
      : ply_(ply),
        mold_(mold),
        shape_(shape),
        options_(options),
        outline_(shape.outline),
        ply_outline_(shape.ply_outline),
        rms_outline_(shape.rms_outline),
        box_(bounding_box(shape.outline)),
        rays_(fibre_rays(ply, shape.centre, shape.angles, spacing / kStepsPerSegment, options.paths)) {}

  PocketNet net(double spacing, const Stop& stop) {
    LayOptions laying;
    laying.paths = options_.paths;
    laying.stop = stop;
    const NetDomain region = fibre_parallelogram(shape_.outline, shape_.centre, shape_.angles, 2 * spacing);
    NetLayer layer(ply_, rays_, shape_.angles, spacing, region, laying);
    const Vector2d size = (box_.high - box_.low) / spacing;
    layer.check_size(size.x() * size.y());
    const std::vector<Found> found = found_from_centre(layer, spacing);
    const Lattice lattice = layer.lattice();
    std::vector<Place> places(lattice.nodes.size());
    for (const Found& f : found) places[lattice.index(f.i, f.j)] = f.place;
    std::vector<NodeKind> kinds = kinds_of(lattice, places);
    remove_pendulums(lattice, places, kinds);
    fix_ends_on_mold(lattice, places, kinds);
    return assembled(lattice, places, kinds);
  }

 private:
  static constexpr int kSteps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};  // by Direction

  bool edge_within(const Vector2d& xy, double distance) const { return ply_outline_.within(xy, distance); }

  static bool kept(const Lattice& lattice, const std::vector<Place>& places, int i, int j) {
    return lattice.has(i, j) && places[lattice.index(i, j)].kept;
  }

  template <class Body>
  static void for_kept(const Lattice& lattice, const std::vector<Place>& places, const Body& body) {
    for (int j = lattice.south; j <= lattice.north; ++j)
      for (int i = lattice.west; i <= lattice.east; ++i)
        if (places[lattice.index(i, j)].kept) body(i, j, lattice.index(i, j));
  }

  Place place_of(const Vector2d& xy, double spacing) const {
    Place place;
    if (((xy - box_.low).array() < -spacing).any() || ((xy - box_.high).array() > spacing).any()) return place;
    place.inside = outline_.inside(xy);
    if (!place.inside && !outline_.within(xy, spacing)) return place;
    place.past_edge = !ply_outline_.empty() && !ply_outline_.inside(xy);
    place.kept = !place.past_edge;
    return place;
  }

  // Lays and returns the kept nodes that are connected to the centre, and their neighbours.
  std::vector<Found> found_from_centre(NetLayer& layer, double spacing) const {
    std::vector<Found> found;
    spread(layer, [&](int i, int j, const Eigen::Vector3d& node) {
      found.push_back({i, j, place_of(node.head<2>(), spacing)});
      return found.size() == 1 || found.back().place.kept;
    });
    return found;
  }

  // Whether a fibre through (i, j) ends at the ply's edge: its next node lies past the edge or, if no next node could
  // be laid, the edge is within one segment's length.
  bool ends_at_edge(const Lattice& lattice, const std::vector<Place>& places, int i, int j) const {
    bool unlaid = false;
    for (const auto& step : kSteps) {
      const int a = i + step[0], b = j + step[1];
      if (!lattice.has(a, b))
        unlaid = true;
      else if (places[lattice.index(a, b)].past_edge)
        return true;
    }
    return unlaid && edge_within(lattice.at(i, j).head<2>(), lattice.spacing);
  }

  bool on_mold(const Eigen::Vector3d& node) const { return lies_on(mold_, node, options_.mold_tol); }

  std::vector<NodeKind> kinds_of(const Lattice& lattice, const std::vector<Place>& places) const {
    std::vector<NodeKind> kinds(places.size(), NodeKind::inner);
    for_kept(lattice, places, [&](int i, int j, std::size_t k) {
      const Vector2d xy = lattice.nodes[k].head<2>();
      if (!places[k].inside && on_mold(lattice.nodes[k]))
        kinds[k] = edge_within(xy, options_.edge_tol) ? NodeKind::free : NodeKind::fixed;
      else if (ends_at_edge(lattice, places, i, j))
        kinds[k] = NodeKind::free;
    });
    return kinds;
  }

  static void remove_pendulums(const Lattice& lattice, std::vector<Place>& places, const std::vector<NodeKind>& kinds) {
    for (bool removed = true; removed;) {
      removed = false;
      for_kept(lattice, places, [&](int i, int j, std::size_t k) {
        if (kinds[k] != NodeKind::inner || (i == 0 && j == 0)) return;
        int segments = 0;
        for (const auto& step : kSteps) segments += kept(lattice, places, i + step[0], j + step[1]);
        if (segments > 1) return;
        places[k].kept = false;
        removed = true;
      });
    }
  }

  // The thin margin of a foot may be narrower than a cell. There the net ends inside the perimeter, but still on the
  // mold.
  void fix_ends_on_mold(const Lattice& lattice, const std::vector<Place>& places, std::vector<NodeKind>& kinds) const {
    for_kept(lattice, places, [&](int i, int j, std::size_t k) {
      if (kinds[k] != NodeKind::inner) return;
      const bool ends = std::any_of(std::begin(kSteps), std::end(kSteps),
                                    [&](const auto& step) { return !kept(lattice, places, i + step[0], j + step[1]); });
      if (ends && on_mold(lattice.nodes[k]))
        kinds[k] = edge_within(lattice.nodes[k].head<2>(), options_.edge_tol) ? NodeKind::free : NodeKind::fixed;
    });
  }

  PocketNet assembled(const Lattice& lattice, const std::vector<Place>& places, const std::vector<NodeKind>& kinds) const {
    std::vector<std::uint8_t> keep(places.size());
    for (std::size_t k = 0; k < keep.size(); ++k) keep[k] = places[k].kept;
    PocketNet out;
    out.net = number_nodes(lattice, keep);
    for (std::size_t n = 0; n < out.net.nodes.size(); ++n) {
      const std::size_t k = lattice.index(out.net.lattice[n][0], out.net.lattice[n][1]);
      const Vector2d xy = lattice.nodes[k].head<2>();
      out.net.kinds[n] = kinds[k];
      out.net.inside[n] = rms_outline_.empty() ? places[k].inside : rms_outline_.inside(xy);
      const Neighbours& around = out.net.neighbours[n];
      const bool misses = *std::min_element(around.begin(), around.end()) < 0;
      if (misses && kinds[k] == NodeKind::inner && !edge_within(xy, options_.edge_tol)) out.open_ends.push_back(static_cast<int>(n));
    }
    return out;
  }

  const Surface& ply_;
  const Surface& mold_;
  const PocketShape& shape_;
  const FibreNetOptions& options_;
  const OutlineSearch outline_, ply_outline_, rms_outline_;
  const Box box_;
  FibreRays rays_;
};

// Returns the spacing d at which outline and band (area A + L d + pi d^2) hold `count` cells of d^2 sin(crossing).
double estimated_spacing(double area, double perimeter, double crossing_sine, double count) {
  const double pi = std::acos(-1.0);
  const double a = std::max(count * crossing_sine - pi, 0.25 * count * crossing_sine);
  return (perimeter + std::sqrt(perimeter * perimeter + 4 * a * area)) / (2 * a);
}

// Lays a net of about `target` nodes. The number of nodes falls with the spacing, but in steps and not always. So the
// estimate is scaled until the count is within 3 % of the target; the spacing then follows the outline's size smoothly,
// whatever the noise on it. Once spacings on both sides of the target are known, the search bisects between them. The
// best net seen is returned.
PocketNet net_with_about(PocketMesher& mesher, double target, double estimate, const Stop& stop) {
  const double near_enough = std::max(1.0, 0.03 * target);
  double too_fine = 0, too_coarse = std::numeric_limits<double>::infinity(), spacing = estimate;
  PocketNet best;
  double best_error = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < 24; ++trial) {
    PocketNet net = mesher.net(spacing, stop);
    const double count = static_cast<double>(net.net.nodes.size());
    const double error = std::abs(count - target);
    (count > target ? too_fine : too_coarse) = spacing;
    if (error < best_error) {
      best_error = error;
      best = std::move(net);
    }
    if (best_error <= near_enough || too_coarse <= too_fine * (1 + 1e-6)) break;
    // The number of nodes varies as the spacing to the power of -2 (wide outline) to -1 (narrow outline).
    const double scaled = spacing * std::clamp(std::pow(count / target, 0.6), 0.5, 2.0);
    const bool bracketed = too_fine > 0 && std::isfinite(too_coarse);
    spacing = bracketed && !(scaled > too_fine && scaled < too_coarse && trial < 6) ? std::sqrt(too_fine * too_coarse) : scaled;
  }
  return best;
}

// A foot may be many times as large as the area above the cut; then the target leaves only a node or two inside the
// outline that decides. So the net is laid finer until there are enough nodes inside, as long as it does not grow
// beyond most_growth times the target.
PocketNet with_enough_inside(PocketMesher& mesher, PocketNet net, double target, const Stop& stop) {
  constexpr double most_growth = 3;
  for (int trial = 0; trial < 8; ++trial) {
    const auto inside = static_cast<double>(std::count(net.net.inside.begin(), net.net.inside.end(), 1));
    if (inside >= kLeastNodesInside) break;
    const double scale = std::clamp(std::sqrt(inside / (kLeastNodesInside + 1)), 0.5, 0.97);
    if (static_cast<double>(net.net.nodes.size()) > most_growth * target * scale * scale) break;
    net = mesher.net(net.net.spacing * scale, stop);
  }
  return net;
}

}  // namespace

void FibreNetOptions::check() const {
  if (spacing) require(std::isfinite(*spacing) && *spacing > 0, "spacing_mm", "a positive length in mm", *spacing);
  require(node_target >= 9 && node_target <= 100000, "node_target", "9 to 100000 nodes", node_target);
  require(std::isfinite(edge_tol) && edge_tol >= 0, "edge_tol_mm", "0 or a positive length in mm", edge_tol);
  require(std::isfinite(mold_tol) && mold_tol > 0, "mold_tol_mm", "a positive length in mm", mold_tol);
}

PocketNet fibre_net(const Surface& ply, const Surface& mold, const PocketShape& given, const FibreNetOptions& options, const Stop& stop) {
  options.check();
  PocketShape shape = given;
  shape.outline = outline_with_area(given.outline, "outline_mm");
  if (!given.ply_outline.empty()) shape.ply_outline = outline_with_area(given.ply_outline, "ply_outline");
  if (!given.rms_outline.empty()) shape.rms_outline = outline_with_area(given.rms_outline, "rms_outline_mm");
  std::ostringstream place;
  place << "(" << shape.centre.x() << ", " << shape.centre.y() << ")";
  require(shape.centre.allFinite(), "centre_mm", "two finite numbers", place.str());
  require(inside(shape.outline, shape.centre), "centre_mm", "a point inside outline_mm", place.str());
  require(shape.ply_outline.empty() || inside(shape.ply_outline, shape.centre), "centre_mm", "a point inside ply_outline", place.str());

  if (stop.now()) throw Stopped("the laying of a net was stopped");
  const double area = surface_area(ply, shape.outline, shape.ply_outline);
  const double sine = std::max(std::abs(std::sin(shape.angles[1] - shape.angles[0])), 0.1);
  const double estimate = estimated_spacing(area, polygon_perimeter(shape.outline), sine, options.node_target);
  PocketMesher mesher(ply, mold, shape, options, options.spacing.value_or(estimate));
  PocketNet net = options.spacing ? mesher.net(*options.spacing, stop) : net_with_about(mesher, options.node_target, estimate, stop);
  if (!options.spacing && !shape.rms_outline.empty()) net = with_enough_inside(mesher, std::move(net), options.node_target, stop);
  net.area = area;
  if (!shape.ply_outline.empty()) {
    net.net.to_edge = ways_to_edge(net.net, shape.ply_outline);
    net.hold_ways = ways_along_fibres(net.net, shape.ply_outline);
    if (!net.held_all_round()) net.past_ends = ways_past_ends(net.net, shape.ply_outline);
    for (std::size_t i = 0; i < net.past_ends.size(); ++i)
      if (net.past_ends[i] > 0 && !lies_on(mold, net.net.nodes[i], options.mold_tol)) net.past_ends[i] = 0;
  }
  return net;
}

}  // namespace debulk
