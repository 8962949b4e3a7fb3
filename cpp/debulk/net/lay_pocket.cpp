#include "debulk/net/lay_pocket.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "debulk/core/error.hpp"
#include "debulk/net/beyond_edge.hpp"
#include "debulk/net/raised.hpp"
#include "debulk/pocket/outline_search.hpp"
#include "debulk/pocket/polygon.hpp"
#include "debulk/pocket/smooth.hpp"

namespace debulk {
namespace {

// The net reaches one spacing past the perimeter. At the ply's edge the patch continues this much further, mm.
constexpr double kMarginBeyondNet = 10.0;

// Width in grid points of the border of zeros round the bump: the spline's response decays by a factor of 4 per grid
// spacing, to below 1e-9 of the bump at the border's end.
constexpr int kBorder = 16;

// The foot contour lies where the ply is mold_tol above the mold. The spline through the patch may stand a little higher
// there, and a band node on it must still count as lying on the mold.
constexpr double kMoldTolAtFoot = 1.25;

// Returns an upper estimate, mm, of the spacing at which a net over `area` mm2 has `count` nodes. N cells of spacing²
// cover the area, and the factor of 2 allows for the nodes in the band outside it, of which a small net has as many as
// inside.
double largest_spacing(double area, int count) {
  return 2 * std::sqrt(area / count);
}

// Returns the point at which a net begins: the centroid, unless it lies outside the pocket or near its rim, as a
// crescent's does; then the point that is deepest inside.
Eigen::Vector2d net_centre(const Polygon& outline, const Eigen::Vector2d& centroid) {
  constexpr double kNearRim = 0.05;  // as a share of the square root of the area
  const bool deep = distance_to_outline(outline, centroid) > kNearRim * std::sqrt(std::abs(polygon_area(outline)));
  return deep && inside(outline, centroid) ? centroid : deepest_point(outline);
}

// A pocket's outline without the ply's cut-outs that lie in it, in which no net can begin.
Polygon on_ply(const Polygon& outline, const Polygon& ply) {
  Polygon out = outline;
  for (const Ring& ring : rings(ply)) {
    if (ring.begin == 0 || !inside(outline, ply[ring.begin])) continue;
    if (out.size() == outline.size()) out.push_back(outline.front());
    out.insert(out.end(), ply.begin() + static_cast<std::ptrdiff_t>(ring.begin), ply.begin() + static_cast<std::ptrdiff_t>(ring.end) + 1);
  }
  return out;
}

// Whether a net on the foot may need nodes past the ply's edge.
bool may_reach(const Polygon& foot, const OutlineSearch& ply_edge) {
  const Box box = bounding_box(foot);
  return ply_edge.within(0.5 * (box.low + box.high), (box.high - box.low).norm());
}

}  // namespace

PocketNet lay_pocket(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const FibreAngles& angles,
                     const Polygon& ply_outline, const LayPocketOptions& options, const Stop& stop) {
  options.check();
  const bool known = id >= 1 && static_cast<std::size_t>(id) <= std::min(segmentation.pockets.size(), feet.feet.size());
  require(known, "pocket_id", "the number of a pocket of the segmentation", id);
  const auto check = [&] {
    if (stop.now()) throw Stopped("the laying of a net was stopped");
  };
  check();
  const auto index = static_cast<std::size_t>(id - 1);
  const Pocket& pocket = segmentation.pockets[index];
  const Polygon& outline = options.mode == PatchMode::paper ? pocket.outline : feet.feet[index].outline;

  PatchOptions window;
  window.mode = options.mode;
  window.margin_mm = kMarginBeyondNet + options.net.spacing.value_or(largest_spacing(feet.feet[index].area, options.net.node_target));
  Grid<double> excess = patch_excess(segmentation, feet, id, window, kBorder);
  check();
  const OutlineSearch ply_edge(ply_outline);
  const BeyondEdge extended(reference, ply_edge);
  const Surface& below = may_reach(outline, ply_edge) ? static_cast<const Surface&>(extended) : reference;
  const Raised surface(below, std::move(excess));
  check();

  PocketShape shape;
  // If other pockets share the foot, most of it may be theirs: the net then begins inside this pocket's own outline.
  const std::int32_t label = feet.feet[index].label;
  const auto sharing = std::count_if(feet.feet.begin(), feet.feet.end(), [&](const Foot& foot) { return foot.label == label; });
  shape.centre = net_centre(on_ply(sharing > 1 ? pocket.outline : outline, ply_outline), pocket.centroid);
  shape.angles = angles;
  shape.outline = outline;
  shape.ply_outline = ply_outline;
  shape.rms_outline = pocket.outline;
  FibreNetOptions net = options.net;
  net.mold_tol = kMoldTolAtFoot * feet.mold_tol_mm;
  // Geodesics would go astray on the step at which the paper's patch is joined to the mold.
  if (options.mode == PatchMode::paper) net.paths = PathRule::vertical_plane;
  PocketNet out = fibre_net(surface, reference, shape, net, stop);
  if (!out.open_ends.empty()) {  // a net that begins near the ply's edge may not reach all of a wide foot; one from its middle may
    shape.centre = deepest_point(on_ply(outline, ply_outline));
    try {
      PocketNet other = fibre_net(surface, reference, shape, net, stop);
      if (other.open_ends.size() < out.open_ends.size()) out = std::move(other);
    } catch (const InputError&) {  // no net can be laid this way: the present one is kept
    }
  }
  return out;
}

}  // namespace debulk
