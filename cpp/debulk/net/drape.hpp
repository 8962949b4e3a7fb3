#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/net/lay.hpp"

namespace debulk {

// A whole ply's net on the mold, laid from a seed point and the two fibre directions there. It gives the fibre angles
// anywhere in the net.
class Drape {
 public:
  // outline: the area to cover, mold XY, mm; the net extends one cell further all round where it can.
  Drape(const Surface& surface, const Eigen::Vector2d& seed, const FibreAngles& angles, double spacing,
        const std::vector<Eigen::Vector2d>& outline, const LayOptions& options = {});

  const Net& net() const { return net_; }

  // Returns the directions of the two fibres at a point of the XY plane, as FibreAngles, each in (-pi, pi]. Between the
  // nodes of a cell, the directions of its sides are interpolated. Returns nullopt where the net does not reach.
  std::optional<FibreAngles> fibre_angles(const Eigen::Vector2d& xy) const;

 private:
  using Cell = std::array<int, 4>;  // numbers of a cell's nodes: a corner, the nodes east and north of it, the opposite corner

  std::optional<FibreAngles> angles_in(const Cell& cell, const Eigen::Vector2d& xy) const;

  Net net_;
  // Cells sorted into square buckets by their bounding boxes (a cell is in each bucket that its box meets).
  std::vector<Cell> cells_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double bucket_ = 1.0;  // mm
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<int>> buckets_;
};

}  // namespace debulk
