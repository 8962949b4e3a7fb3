#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

namespace debulk {

// Second derivatives of an energy of a polyline: block [i][k] is by node i (rows) and node i + k (columns).
using SectionBlocks = std::vector<std::array<Eigen::Matrix2d, 3>>;

// Energy of the ply's cross-section, a polyline of nodes (x, z), per unit of width, divided by the pressure P
// (docs/model.md, section 6). With p the share of the full pressure, it is the sum of
//   bending   (l^3 / 2) sum of theta_i^2 / s_i over the inner nodes, l^3 = c / P, theta_i the turning angle, s_i a node's
//             length;
//   pressure  p times the area between the line and z = 0 (following: the pressure is normal to the ply, and the area is
//             its potential because the ends are pinned), or p sum s_i (up . x_i) (vertical: a dead load along -up).
// The ends carry no moment.
class SectionEnergy {
 public:
  enum class Pressure { following, vertical };

  // Lengths may be in any unit, the same as that of the positions.
  SectionEnergy(const Eigen::VectorXd& segment_lengths, double natural_length, Pressure kind, const Eigen::Vector2d& up);

  void set_pressure(double share) { share_ = share; }
  double pressure() const { return share_; }
  double natural_length() const { return natural_length_; }
  double node_length(long i) const { return node_lengths_[i]; }

  double value(const Eigen::Matrix2Xd& x) const;
  void gradient(const Eigen::Matrix2Xd& x, Eigen::Matrix2Xd& out) const;
  void add_hessian(const Eigen::Matrix2Xd& x, double weight, SectionBlocks& out) const;

 private:
  Eigen::VectorXd node_lengths_;  // half the sum of the segments on both sides
  double natural_length_, stiffness_;
  Pressure kind_;
  Eigen::Vector2d up_;
  double share_ = 1.0;
};

}  // namespace debulk
