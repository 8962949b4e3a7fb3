#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/stop.hpp"
#include "debulk/net/net.hpp"
#include "debulk/net/path.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// Directions of the two fibres, radians, counter-clockwise from the mold's +x, projected along z into the tangent plane.
using FibreAngles = std::array<double, 2>;

// A net as it is laid: nodes on the lattice of steps (i, j) along the first and second fibre, west <= i <= east and
// south <= j <= north; (0, 0) is the centre. A node that could not be laid is NaN.
struct Lattice {
  int west = 0, east = 0, south = 0, north = 0;
  double spacing = 0.0;                // mm
  std::vector<Eigen::Vector3d> nodes;  // mm, row by row along the first fibre

  int columns() const { return east - west + 1; }
  int rows() const { return north - south + 1; }
  std::size_t index(int i, int j) const { return static_cast<std::size_t>(j - south) * columns() + (i - west); }
  bool has(int i, int j) const { return i >= west && i <= east && j >= south && j <= north && nodes[index(i, j)].allFinite(); }
  const Eigen::Vector3d& at(int i, int j) const { return nodes[index(i, j)]; }
};

struct LayOptions {
  PathRule paths = PathRule::geodesic;
  // A spacing that needs more is refused.
  long longest_path = 20000;  // nodes, from the centre
  long most_nodes = 4000000;  // lattice places
  Stop stop;                  // raised: Stopped is thrown

  void check() const;
};

// The four initial paths from a centre, by Direction; `step` as of FibreRay.
using FibreRays = std::array<FibreRay, 4>;
FibreRays fibre_rays(const Surface& surface, const Eigen::Vector2d& centre, const FibreAngles& angles, double step, PathRule rule);

// Lays the nodes of a net as they are asked for, each from its two neighbours towards the initial paths, as lay_net() says: which
// others were asked for before makes no difference.
class NetLayer {
 public:
  // The rays are those of this centre and these angles; they, the surface and the region are kept by reference.
  NetLayer(const Surface& surface, FibreRays& rays, const FibreAngles& angles, double spacing, const NetDomain& region,
           const LayOptions& options);

  const Eigen::Vector3d* at(int i, int j);  // none where no node can be laid; valid until the next call
  // All nodes laid so far.
  Lattice lattice() const;

 private:
  enum class State : std::uint8_t { unknown, none, laid };

  bool within(int i, int j) const { return i >= lattice_.west && i <= lattice_.east && j >= lattice_.south && j <= lattice_.north; }
  State state(int i, int j) const { return within(i, j) ? states_[lattice_.index(i, j)] : State::unknown; }
  void make_room(int i, int j);
  void lay(int i, int j);
  const Eigen::Vector3d* on_path(int i, int j);

  const Surface& surface_;
  const NetDomain& region_;
  LayOptions options_;
  double turn_;  // its sign: which way round the two fibres cross, seen from above
  std::array<RayNodes, 4> paths_;
  Lattice lattice_;
  std::vector<State> states_;
  std::vector<std::array<int, 2>> asked_;
  long laid_ = 0;
};

// Lays a net from `centre`: the two initial paths, then each quadrant's nodes from their two neighbours towards the paths.
// A path ends at the region's border; a cell whose last node is outside the region, or that shears beyond what a pin-jointed
// net can (2 degrees from closing) or would fold over, does not exist, and neither do the cells that would continue it.
// Every segment is `spacing` long (to about 1e-13 of it), every node on the surface.
Lattice lay_net(const Surface& surface, const Eigen::Vector2d& centre, const FibreAngles& angles, double spacing, const NetDomain& region,
                const LayOptions& options = {});

// The point of the surface at distance `spacing` from a and b that is not `common`, itself at that distance from both:
// the fourth corner of the cell common - a - x - b. Nothing where the cell is locked or the surface is not met.
std::optional<Eigen::Vector3d> fourth_node(const Surface& surface, const Eigen::Vector3d& common, const Eigen::Vector3d& a,
                                           const Eigen::Vector3d& b, double spacing);

// The smallest parallelogram along the fibres (seen from above) about the outline, wider by `margin` on each side and by a
// quarter of its extent, because fibres on a curved surface do not stay parallel. A net laid in it covers the outline: a
// node needs every node between itself and the paths, inside the outline or not.
NetDomain fibre_parallelogram(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& centre, const FibreAngles& angles,
                              double margin);

// The kept nodes of a lattice as a net with its segments (kinds inner, no node inside), numbered row by row along one fibre:
// the first or the second, whichever gives the smaller bandwidth (a tie: the first). keep: one per lattice place.
Net number_nodes(const Lattice& lattice, const std::vector<std::uint8_t>& keep);

}  // namespace debulk
