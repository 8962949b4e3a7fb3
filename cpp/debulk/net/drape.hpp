#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/net/lay.hpp"

namespace debulk {

// A whole ply's net on the mold, from a seed point and its two fibre directions: gives the fibre angles anywhere in it.
class Drape {
 public:
  // outline: what to cover, mold XY, mm; the net goes one cell further all round where it can.
  Drape(const Surface& surface, const Eigen::Vector2d& seed, const FibreAngles& angles, double spacing,
        const std::vector<Eigen::Vector2d>& outline, const LayOptions& options = {});

  const Net& net() const { return net_; }

  // Directions of the two fibres at a point of the XY plane, as FibreAngles, each in (-pi, pi]; between the nodes of a cell
  // the directions of its sides are blended. Nothing where the net does not reach.
  std::optional<FibreAngles> fibre_angles(const Eigen::Vector2d& xy) const;

 private:
  using Cell = std::array<int, 4>;  // node numbers: the cell's corner, the ones east and north of it, the opposite one

  std::optional<FibreAngles> angles_in(const Cell& cell, const Eigen::Vector2d& xy) const;

  Net net_;
  // Cells sorted into square buckets by the boxes about them (a cell is in each bucket that its box meets).
  std::vector<Cell> cells_;
  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  double bucket_ = 1.0;  // mm
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<int>> buckets_;
};

}  // namespace debulk
