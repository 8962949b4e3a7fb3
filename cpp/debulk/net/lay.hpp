#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/stop.hpp"
#include "debulk/net/generator_cells.hpp"
#include "debulk/net/net.hpp"
#include "debulk/net/path.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// A net as it is laid: nodes on the lattice of steps (i, j) along the first and second fibre, with west <= i <= east
// and south <= j <= north; (0, 0) is the centre. A node that could not be laid is NaN.
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
  // A spacing that needs more than these numbers is refused with InputError.
  long longest_path = 20000;  // nodes, from the centre
  long most_nodes = 4000000;  // lattice places
  Stop stop;                  // Stopped is thrown when it is raised

  void check() const;
};

// The four initial paths from a centre, indexed by Direction; `step` as in FibreRay.
using FibreRays = std::array<FibreRay, 4>;
FibreRays fibre_rays(const Surface& surface, const Eigen::Vector2d& centre, const FibreAngles& angles, double step, PathRule rule);

// Lays the nodes of a net as they are asked for: those of the two initial paths (or of the generator cells), and every
// other from its two neighbours towards these. A path ends at the region's border. A cell is left out if its last node
// is outside the region, if it shears beyond what a pin-jointed net can (2 degrees from closing) or if it would fold
// over; so are the cells that would continue it. Every segment is `spacing` long (to about 1e-13 of it), and every node
// is on the surface. A node does not depend on which other nodes were asked for before. Throws InputError and Stopped.
class NetLayer {
 public:
  // The rays must start from the net's centre, at these angles. The rays, the surface and the region are kept by
  // reference.
  NetLayer(const Surface& surface, FibreRays& rays, const FibreAngles& angles, double spacing, const NetDomain& region,
           const LayOptions& options);

  const Eigen::Vector3d* at(int i, int j);  // null where no node can be laid; valid until the next call
  // All nodes laid so far.
  Lattice lattice() const;
  // Throws InputError if a net of so many nodes would be too large.
  void check_size(double nodes) const;

 private:
  enum class State : std::uint8_t { unknown, none, laid };

  bool within(int i, int j) const { return i >= lattice_.west && i <= lattice_.east && j >= lattice_.south && j <= lattice_.north; }
  State state(int i, int j) const { return within(i, j) ? states_[lattice_.index(i, j)] : State::unknown; }
  // Whether a node belongs to the initial paths or cells.
  bool begins(int i, int j) const { return cells_ ? GeneratorCells::include(i, j) : i == 0 || j == 0; }
  void make_room(int i, int j);
  void lay(int i, int j);
  const Eigen::Vector3d* on_path(int i, int j);
  std::optional<std::string> trapped() const;
  [[noreturn]] void refuse_size() const;

  const Surface& surface_;
  const NetDomain& region_;
  LayOptions options_;
  double turn_;  // its sign shows in which sense the two fibres cross, seen from above
  FibreAngles angles_;
  std::array<RayNodes, 4> paths_;
  std::optional<GeneratorCells> cells_;  // in place of the paths if the rule is least_shear
  Lattice lattice_;
  std::vector<State> states_;
  std::vector<std::array<int, 2>> asked_;
  long laid_ = 0;
};

// Returns the smallest parallelogram along the fibres (seen from above) that contains the outline, enlarged by `margin`
// on each side and by a quarter of its extent, because fibres on a curved surface do not stay parallel. A net laid in
// it covers the outline: a node needs every node between itself and the paths, whether inside the outline or not.
NetDomain fibre_parallelogram(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& centre, const FibreAngles& angles,
                              double margin);

// Returns the kept nodes of a lattice as a net with its segments (all kinds are inner, no node is marked inside). The
// nodes are numbered row by row along the first or the second fibre, whichever gives the smaller bandwidth (the first
// if they are equal). keep: one value per lattice place.
Net number_nodes(const Lattice& lattice, const std::vector<std::uint8_t>& keep);

}  // namespace debulk
