#pragma once

#include <type_traits>

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
    // Brings derivatives by r, s and the axis, one in each row of a column, to the coordinates of the nodes.
    const auto to_nodes = [&](const auto& by) {
      constexpr int columns = std::decay_t<decltype(by)>::ColsAtCompileTime;
      const auto by_r = by.template topRows<3>(), by_s = by.template middleRows<3>(3), by_axis = by.template bottomRows<3>();
      const Eigen::Matrix<double, 3, columns> by_along = cross_matrix(across) * by_axis, by_across = -cross_matrix(along) * by_axis;
      Eigen::Matrix<double, 15, columns> nodes;
      nodes << by_r - by_s, -by_r - by_along, by_s + by_along, by_across, -by_across;
      return nodes;
    };
    out.gradient = to_nodes(at.gradient);
    if (order == Order::gradient) return out;
    out.hessian = to_nodes(to_nodes(at.hessian).transpose().eval());
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
