#pragma once

#include "debulk/net/net.hpp"
#include "debulk/sheet/axis_angle.hpp"
#include "debulk/sheet/spring_term.hpp"

namespace debulk {

// Torsion of the tows, which lie flat in the ply and twist with it (docs/model.md, section 3.1): summed over segments
// T/4 (theta_left^2 + theta_right^2), T the torsional stiffness of a tow over the width that it stands for, N mm.
// theta is the angle about the segment between the crossing fibres at its two ends, on either side where the net has a
// cell. A ply that is twisted by tau per mm, along both fibres, has T tau^2 per mm2.
class Torsion : public SpringTerm<4> {
 public:
  Torsion(double stiffness_mj, const std::vector<Neighbours>& neighbours) : SpringTerm(&angle, stiffness_mj / 2, springs(neighbours)) {}

 private:
  // Nodes: the segment from 0 to 1, and the neighbours 2 of 0 and 3 of 1 across it.
  static Angle angle(const Corners& x, Order order) {
    const AxisAngle at = axis_angle(x[2] - x[0], x[3] - x[1], x[1] - x[0], order);
    Angle out;
    out.theta = at.theta;
    if (order == Order::value) return out;
    out.gradient = to_nodes(at.gradient);
    if (order == Order::hessian) out.hessian = to_nodes(to_nodes(at.hessian).transpose());
    return out;
  }

  // Brings derivatives by the three vectors, one in each row of a column, to the coordinates of the nodes.
  template <class Nine>
  static Eigen::Matrix<double, 12, Nine::ColsAtCompileTime> to_nodes(const Eigen::MatrixBase<Nine>& by) {
    const auto by_r = by.template topRows<3>(), by_s = by.template middleRows<3>(3), by_e = by.template bottomRows<3>();
    Eigen::Matrix<double, 12, Nine::ColsAtCompileTime> out;
    out << -by_r - by_e, by_e - by_s, by_r, by_s;
    return out;
  }

  static std::vector<Nodes> springs(const std::vector<Neighbours>& neighbours) {
    std::vector<Nodes> out;
    for (std::size_t i = 0; i < neighbours.size(); ++i)
      for (const auto& [along, one, other] : {std::array{east, north, south}, {north, east, west}}) {
        const int next = neighbours[i][along];
        if (next < 0) continue;
        for (const Direction across : {one, other}) {
          const int beside = neighbours[i][across], beside_next = neighbours[static_cast<std::size_t>(next)][across];
          if (beside >= 0 && beside_next >= 0) out.push_back({static_cast<int>(i), next, beside, beside_next});
        }
      }
    return out;
  }
};

}  // namespace debulk
