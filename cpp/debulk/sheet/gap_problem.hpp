#pragma once

#include <vector>

#include "debulk/sheet/sheet.hpp"
#include "debulk/solve/problem.hpp"

namespace debulk {

// The sheet as a Problem in gap coordinates, (x, y, z - F(x, y)) / Delta of each movable node, in which the contact with
// the mold is a plain bound h >= 0. Energies are in units of force unit times Delta; the equality of a segment is
// (|x_i - x_j|^2 / Delta^2 - 1) / 2, its strain for small ones.
// One object serves one solve at a time: it keeps its buffers, and what it found at the last point.
class GapProblem : public Problem {
 public:
  explicit GapProblem(const Sheet& sheet);

  int variables() const override { return 3 * static_cast<int>(sheet_.movable().size()); }
  int equalities() const override { return static_cast<int>(constrained_.size()); }
  Eigen::VectorXd start() const override { return from_points(sheet_.start()); }
  Eigen::VectorXd lower() const override;
  double reach() const override { return reach_; }

  double value(const Eigen::VectorXd& y) const override;
  void gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const override;
  void constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const override;
  std::vector<Entry> jacobian_pattern() const override;
  void jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const override;
  std::vector<Entry> hessian_pattern() const override;
  void hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
               Eigen::Ref<Eigen::VectorXd> values) const override;

  Points to_points(const Eigen::VectorXd& y) const;
  Eigen::VectorXd from_points(const Points& x) const;

 private:
  struct Segment {
    int i, j;                       // nodes
    int place_i, place_j;           // among the movable ones; -1: fixed
    int slot_ii, slot_ij, slot_jj;  // of its blocks; -1: fixed
  };
  // What belongs to one y: nodes, the mold below the movable ones, and, once asked for, energy, gradient and Hessian there.
  struct State {
    Eigen::VectorXd y;
    Points x, gradient;
    std::vector<SurfaceSample> mold;
    double energy = 0;
    BlockMatrix curvature;  // of the energy
    bool differentiated = false, curved = false;
  };
  State& at(const Eigen::VectorXd& y) const;
  State& differentiated_at(const Eigen::VectorXd& y) const;

  const Sheet& sheet_;
  double length_, energy_;            // units: Delta (mm), force unit times Delta (mJ)
  double reach_;                      // twice the net's size: further, it has slid off
  std::vector<int> place_;            // of a node among the movable ones; -1: fixed
  std::vector<Segment> constrained_;  // segments with a movable end
  mutable State state_;
  mutable BlockMatrix blocks_;
};

}  // namespace debulk
