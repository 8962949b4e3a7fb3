#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "debulk/section/energy.hpp"
#include "debulk/section/profile.hpp"
#include "debulk/solve/problem.hpp"

namespace debulk {

// One fold of the ply's cross-section on the mold, as a Problem. There are nodes 0 to n, with n even; 0 and n are
// pinned on the mold. The node in the middle, the crown, stays on the line x = 0 and upright: its two neighbours are at
// the same height. The other nodes have the coordinates
//   u = distance from that line, on the node's own side,   h = z - F(x), the gap to the mold,
// so that contact with the mold is h >= 0, and contact of the two flanks, which are mirror images on a symmetric mold,
// is u >= half their distance. Without the guide at the crown, the fold could slide along the mold at no cost. The
// equalities are the strains (|d|^2 / s^2 - 1) / 2 of the segments, whose multipliers are tensions times s, and the
// equal heights at the crown.
class SectionProblem : public Problem {
 public:
  // All lengths are in one unit, which must be of the order of the fold's height, because a minimiser's longest step
  // and first distance from contacts are fixed in this unit. `start`: (x, z) of the nodes; the first and the last stay
  // pinned. `flank_distance`: without a value, the flanks may pass through each other.
  SectionProblem(SectionProfile mold, Eigen::VectorXd segment_lengths, Eigen::Matrix2Xd start, SectionEnergy energy,
                 std::optional<double> flank_distance);

  int variables() const override { return 2 * nodes() - 5; }
  int equalities() const override { return segments() + 1; }
  Eigen::VectorXd start() const override { return from_line(start_); }
  Eigen::VectorXd lower() const override;
  double value(const Eigen::VectorXd& y) const override { return scale_ * energy_.value(to_line(y)); }
  void gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const override;
  void constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const override;
  std::vector<Entry> jacobian_pattern() const override;
  void jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const override;
  std::vector<Entry> hessian_pattern() const override;
  void hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
               Eigen::Ref<Eigen::VectorXd> values) const override;

  int segments() const { return static_cast<int>(lengths_.size()); }
  int nodes() const { return segments() + 1; }
  int crown() const { return segments() / 2; }
  const Eigen::VectorXd& lengths() const { return lengths_; }
  double scale() const { return scale_; }  // factor of the energy in f
  double rounding() const;                 // rounding error of the gradient of f
  const SectionProfile& mold() const { return mold_; }
  // The index of coordinate a (0: u, 1: h) of a node among the variables; -1 if it is not a variable.
  int place(int node, int a) const;
  Eigen::Matrix2Xd to_line(const Eigen::VectorXd& y) const;  // (x, z) of the nodes
  Eigen::VectorXd from_line(const Eigen::Matrix2Xd& line) const;

  void set_pressure(double share) { energy_.set_pressure(share); }
  const SectionEnergy& energy() const { return energy_; }

 private:
  double side(int node) const { return node < crown() ? -1.0 : 1.0; }
  // Returns the derivative of a node's position by its (u, h).
  Eigen::Matrix2d frame(int node, const Eigen::Matrix2Xd& line) const;

  SectionEnergy energy_;
  SectionProfile mold_;
  Eigen::VectorXd lengths_;
  Eigen::Matrix2Xd start_;
  std::optional<double> flank_distance_;
  double scale_;
};

}  // namespace debulk
