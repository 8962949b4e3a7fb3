#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/net/path.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// The cells from which a net with PathRule::least_shear is laid: two crossing strips, one cell wide, of the nodes (i, j)
// in which i or j is 0 or 1. Every cell of a strip joins two known nodes and has one freedom, the heading of its sides.
// It is chosen so that the cell shears least; then the four corners' shear angles, with their signs, sum to 0 (C. Krogh,
// B. L. V. Bak, E. Lindgaard, A. M. Olesen, S. M. Hermansen, P. H. Broberg, J. A. Kepler, E. Lund and J. Jakobsen: A
// simple MATLAB draping code for fiber-reinforced composites with application to optimization of manufacturing process
// parameters, Struct. Multidisc. Optim. 64, 2021, "generator cells"). Shear is the change of the angle at which the
// fibres cross in space at the centre. As there, the first segment, from (0, 0) to (0, 1), has the direction of the
// second fibre as seen from above.
class GeneratorCells {
 public:
  // The surface and the region are kept by reference.
  GeneratorCells(const Surface& surface, const Eigen::Vector2d& centre, const FibreAngles& angles, double spacing, const NetDomain& region);

  static bool include(int i, int j) { return (i >= 0 && i <= 1) || (j >= 0 && j <= 1); }

  // A node for which include() is true. Null past an arm's end: where the next cell would leave the region or the
  // surface, lock, fold over, or turn back.
  const Eigen::Vector3d* node(int i, int j);

 private:
  // The two nodes of an arm at one number of steps from the centre: `first` in row or column 0, `second` in 1.
  struct Rung {
    Eigen::Vector3d first, second;
  };
  // One of the four arms, from the rung in row or column 0 outwards.
  struct Arm {
    std::vector<Rung> rungs;
    double side;   // +1 if the arm turns counter-clockwise from its rungs, -1 if clockwise
    double angle;  // between rung and arm at `first`, in a cell that does not shear, rad
    bool ended;
  };

  std::optional<Rung> next(const Arm& arm) const;
  std::optional<Rung> rung_beyond(const Rung& last, const Arm& arm, double heading) const;
  bool extend(Arm& arm) const;

  const Surface& surface_;
  const NetDomain& region_;
  double spacing_;
  std::array<Arm, 4> arms_;  // by Direction
};

}  // namespace debulk
