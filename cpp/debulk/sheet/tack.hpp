#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "debulk/sheet/term.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// Tack as an elastic foundation (docs/model.md, section 3.1): k a h^2 / 2 for each node that lies on the mold at the
// start, where h is its gap, a the area that it represents and k the stiffness of the resin between ply and mold. It
// holds the ply down but does not hinder it from sliding.
class Tack : public Term {
 public:
  static constexpr double kReach_mm = 0.2;  // a node with a larger gap at the start does not stick (patch.mold_tol_mm)

  Tack(double stiffness_n_mm3, std::vector<double> areas_mm2, std::vector<int> nodes, std::shared_ptr<const Surface> mold)
      : stiffness_(stiffness_n_mm3), areas_(std::move(areas_mm2)), nodes_(std::move(nodes)), mold_(std::move(mold)) {}

  double value(const Points& x) const override {
    double sum = 0;
    for_each(x, [&](int, double spring, double gap, const Eigen::Vector3d&, const SurfaceSample&) { sum += spring / 2 * gap * gap; });
    return sum;
  }
  double add_gradient(const Points& x, Points& gradient) const override {
    for_each(x, [&](int node, double spring, double gap, const Eigen::Vector3d& normal, const SurfaceSample&) {
      gradient[static_cast<std::size_t>(node)] += spring * gap * normal;
    });
    return value(x);
  }
  double largest_force(const Points& x) const override {
    double largest = 0;
    for_each(x, [&](int, double spring, double gap, const Eigen::Vector3d& normal, const SurfaceSample&) {
      largest = std::max(largest, spring * std::abs(gap) * normal.norm());
    });
    return largest;
  }
  void add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const override {
    std::size_t next = 0;
    for_each(x, [&](int node, double spring, double gap, const Eigen::Vector3d& normal, const SurfaceSample& mold) {
      Eigen::Matrix3d block = spring * normal * normal.transpose();
      block.topLeftCorner<2, 2>() -= spring * gap * mold.hessian;
      hessian.add(places[next++], node, node, block);
    });
  }
  Places places(const BlockMatrix& pattern) const override {
    Places out;
    for (const int node : nodes_) out.push_back(pattern.slot(node, node));
    return out;
  }

 private:
  // Calls body(node, stiffness of its spring in N/mm, gap, gradient of the gap, mold below).
  template <class Body>
  void for_each(const Points& x, const Body& body) const {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const Eigen::Vector3d& at = x[static_cast<std::size_t>(nodes_[k])];
      const SurfaceSample mold = mold_->sample(at.head<2>());
      body(nodes_[k], stiffness_ * areas_[k], at.z() - mold.height, Eigen::Vector3d(-mold.gradient.x(), -mold.gradient.y(), 1.0), mold);
    }
  }

  double stiffness_;           // N/mm3
  std::vector<double> areas_;  // mm2, one for each of the nodes
  std::vector<int> nodes_;
  std::shared_ptr<const Surface> mold_;
};

}  // namespace debulk
