#pragma once

#include <array>
#include <vector>

#include "debulk/sheet/angle.hpp"
#include "debulk/sheet/term.hpp"

namespace debulk {

// stiffness * sum of Law(angle) over corners. A corner is a node with two of its neighbours, u = x_a - x_node and
// v = sign * (x_b - x_node); sign = -1 turns the corner's angle into the turning angle of a line a - node - b.
struct Corner {
  int node, a, b;
};

template <AngleLaw (*Law)(double, double), int Sign>
class AngleTerm : public Term {
 public:
  AngleTerm(double stiffness, std::vector<Corner> corners) : stiffness_(stiffness), corners_(std::move(corners)) {}

  double value(const Points& x) const override {
    double sum = 0;
    for (const Corner& corner : corners_) {
      const Arms arms(x, corner);
      sum += Law(arms.cross.squaredNorm(), arms.u.dot(arms.v)).value;
    }
    return stiffness_ * sum;
  }

  double add_gradient(const Points& x, Points& gradient) const override {
    double sum = 0;
    AngleDerivatives by;
    for (const Corner& corner : corners_) {
      const Arms arms(x, corner);
      const AngleLaw law = Law(arms.cross.squaredNorm(), arms.u.dot(arms.v));
      angle_gradient(law, arms.u, arms.v, arms.cross, by);
      const Eigen::Vector3d at_a = stiffness_ * by.u, at_b = Sign * stiffness_ * by.v;
      gradient[static_cast<std::size_t>(corner.a)] += at_a;
      gradient[static_cast<std::size_t>(corner.b)] += at_b;
      gradient[static_cast<std::size_t>(corner.node)] -= at_a + at_b;
      sum += law.value;
    }
    return stiffness_ * sum;
  }

  void add_hessian(const Points& x, BlockMatrix& hessian) const override {
    AngleDerivatives by;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      const auto [node, a, b] = corners_[k];
      const Arms arms(x, corners_[k]);
      const AngleLaw law = Law(arms.cross.squaredNorm(), arms.u.dot(arms.v));
      angle_hessian(law, arms.u, arms.v, arms.cross, by);
      const Eigen::Matrix3d aa = stiffness_ * by.uu, ab = Sign * stiffness_ * by.uv, bb = stiffness_ * by.vv;
      const Slots& slot = slots_[k];
      hessian.add(slot[0], a, a, aa);
      hessian.add(slot[1], b, b, bb);
      hessian.add(slot[2], a, b, ab);
      hessian.add(slot[3], a, node, -aa - ab);
      hessian.add(slot[4], b, node, -bb - ab.transpose());
      hessian.add(slot[5], node, node, aa + ab + ab.transpose() + bb);
    }
  }

  std::vector<std::array<int, 3>> groups() const override {
    std::vector<std::array<int, 3>> out;
    for (const Corner& corner : corners_) out.push_back({corner.node, corner.a, corner.b});
    return out;
  }

  void attach(const BlockMatrix& pattern) override {
    slots_.clear();
    for (const auto& [node, a, b] : corners_)
      slots_.push_back({pattern.slot(a, a), pattern.slot(b, b), pattern.slot(a, b), pattern.slot(a, node), pattern.slot(b, node),
                        pattern.slot(node, node)});
  }

 private:
  struct Arms {
    Eigen::Vector3d u, v, cross;
    Arms(const Points& x, const Corner& corner)
        : u(x[static_cast<std::size_t>(corner.a)] - x[static_cast<std::size_t>(corner.node)]),
          v(Sign * (x[static_cast<std::size_t>(corner.b)] - x[static_cast<std::size_t>(corner.node)])),
          cross(u.cross(v)) {}
  };
  using Slots = std::array<int, 6>;

  double stiffness_;
  std::vector<Corner> corners_;
  std::vector<Slots> slots_;
};

}  // namespace debulk
