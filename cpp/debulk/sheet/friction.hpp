#pragma once

#include <cmath>
#include <utility>

#include "debulk/sheet/term.hpp"

namespace debulk {

// Paper eq. (7) on free boundary nodes: mu P a times the distance moved, where a is the area that grips at the node
// (lumping.hpp). The distance is rounded at the start so that it has derivatives there: sqrt(delta^2 + eps^2) - eps
// with eps = 1e-3 Delta (docs/model.md, section 3).
class Friction : public Term {
 public:
  // forces_n: friction force mu P a of each of the nodes, N.
  Friction(std::vector<double> forces_n, double spacing_mm, std::vector<int> nodes, const Points& start)
      : forces_(std::move(forces_n)), rounding_(1e-3 * spacing_mm), nodes_(std::move(nodes)), start_(start) {}

  double value(const Points& x) const override {
    double sum = 0;
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const auto i = static_cast<std::size_t>(nodes_[k]);
      const double moved_squared = (x[i] - start_[i]).squaredNorm();
      sum += forces_[k] * moved_squared / (std::sqrt(moved_squared + rounding_ * rounding_) + rounding_);
    }
    return sum;
  }
  double add_gradient(const Points& x, Points& gradient) const override {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const auto i = static_cast<std::size_t>(nodes_[k]);
      const Eigen::Vector3d moved = x[i] - start_[i];
      gradient[i] += forces_[k] / std::sqrt(moved.squaredNorm() + rounding_ * rounding_) * moved;
    }
    return value(x);
  }
  void add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const override {
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const int node = nodes_[k];
      const auto i = static_cast<std::size_t>(node);
      const Eigen::Vector3d moved = x[i] - start_[i];
      const double length = std::sqrt(moved.squaredNorm() + rounding_ * rounding_);
      const Eigen::Matrix3d block = forces_[k] / length * (Eigen::Matrix3d::Identity() - moved * moved.transpose() / (length * length));
      hessian.add(places[k], node, node, block);
    }
  }
  Places places(const BlockMatrix& pattern) const override {
    Places out;
    for (const int node : nodes_) out.push_back(pattern.slot(node, node));
    return out;
  }

 private:
  std::vector<double> forces_;  // N
  double rounding_;             // eps, mm
  std::vector<int> nodes_;
  Points start_;
};

}  // namespace debulk
