#pragma once

#include <vector>

#include "debulk/sheet/sheet.hpp"
#include "debulk/solve/problem.hpp"

namespace debulk {

// The sheet as a Problem in gap coordinates, (x, y, z - F(x, y)) / Delta of each movable node, in which contact with
// the mold is a plain bound h >= 0. Energies are in units of force unit times Delta. The equality of a segment is
// (|x_i - x_j|^2 / Delta^2 - 1) / 2, which is the strain if it is small. One object serves one solve at a time, because
// it keeps buffers and the results at the last point.
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
    int place_i, place_j;           // index among the movable nodes; -1: fixed
    int slot_ii, slot_ij, slot_jj;  // slots of its blocks; -1: fixed
  };
  // The values at one y: nodes, the mold below the movable nodes and, once asked for, energy, gradient and Hessian.
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
  double length_, energy_;            // units of length, Delta (mm), and of energy, force unit times Delta (mJ)
  double reach_;                      // twice the net's size; farther away, the net has slid off
  std::vector<int> place_;            // index of a node among the movable nodes; -1: fixed
  std::vector<Segment> constrained_;  // segments with a movable end
  mutable State state_;
  mutable BlockMatrix blocks_;
};

}  // namespace debulk
