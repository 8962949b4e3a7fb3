#pragma once

#include <Eigen/Geometry>

#include "debulk/net/net.hpp"
#include "debulk/sheet/axis_angle.hpp"
#include "debulk/sheet/spring_term.hpp"

namespace debulk {

// Bending of the tows within the surface, the second gradient of the paper's outlook (docs/model.md, section 3.1):
// summed over nodes B/2 (theta_1^2 + theta_2^2), B the bending stiffness of a tow within the ply over the width that it
// stands for, N mm. theta is the angle about the surface's normal by which a fibre turns at a node that has all four
// neighbours. The normal is that of the two chords between opposite neighbours.
class InPlaneBending : public SpringTerm<5> {
 public:
  InPlaneBending(double stiffness_mj, const std::vector<Neighbours>& neighbours) : SpringTerm(&angle, stiffness_mj, springs(neighbours)) {}

 private:
  // Nodes: 0, along the fibre 1 behind and 2 ahead of it, across it 3 and 4.
  static Angle angle(const Corners& x, Order order) {
    const Eigen::Vector3d along = x[2] - x[1], across = x[3] - x[4];
    const AxisAngle at = axis_angle(x[0] - x[1], x[2] - x[0], along.cross(across), order);
    Angle out;
    out.theta = at.theta;
    if (order == Order::value) return out;
    const Eigen::Matrix3d one = Eigen::Matrix3d::Identity(), by_along = -cross_matrix(across), by_across = cross_matrix(along);
    Eigen::Matrix<double, 9, 15> by_node = Eigen::Matrix<double, 9, 15>::Zero();
    by_node.block<6, 9>(0, 0) << one, -one, Eigen::Matrix3d::Zero(), -one, Eigen::Matrix3d::Zero(), one;
    by_node.block<3, 12>(6, 3) << -by_along, by_along, by_across, -by_across;
    out.gradient = by_node.transpose() * at.gradient;
    if (order == Order::gradient) return out;
    out.hessian = by_node.transpose() * at.hessian * by_node;
    // The axis is a product of the chords: its second derivative, by along and across, is constant.
    const Eigen::Matrix3d mixed = -cross_matrix(at.gradient.tail<3>());
    for (const auto& [row, column, sign] : {std::array{2, 3, 1}, {2, 4, -1}, {1, 3, -1}, {1, 4, 1}}) {
      out.hessian.block<3, 3>(3 * row, 3 * column) += sign * mixed;
      out.hessian.block<3, 3>(3 * column, 3 * row) += sign * mixed.transpose();
    }
    return out;
  }

  static std::vector<Nodes> springs(const std::vector<Neighbours>& neighbours) {
    std::vector<Nodes> out;
    for (std::size_t i = 0; i < neighbours.size(); ++i) {
      const auto& [e, w, n, s] = neighbours[i];
      if (e < 0 || w < 0 || n < 0 || s < 0) continue;
      out.push_back({static_cast<int>(i), w, e, n, s});
      out.push_back({static_cast<int>(i), s, n, w, e});
    }
    return out;
  }
};

}  // namespace debulk
